"""What is in a raw recording, read by other code than ours."""

import struct
import sys


def messages(path):
    """The messages of an MCAP file that is not compressed: (channel, sequence, log time in s, bytes)."""
    data = path.read_bytes()
    out = []

    def read(begin, end):
        while begin + 9 <= end:
            code, length = struct.unpack_from("<BQ", data, begin)
            body = begin + 9
            if body + length > end:
                return
            if code == 6:
                compression = struct.unpack_from("<I", data, body + 28)[0]
                if compression:
                    sys.exit(f"FAILED: {path} is compressed")
                size = struct.unpack_from("<Q", data, body + 32)[0]
                read(body + 40, body + 40 + size)
            elif code == 5:
                channel, sequence, time = struct.unpack_from("<HIQ", data, body)
                out.append((channel, sequence, time * 1e-9, data[body + 22:body + length]))
            begin = body + length

    read(8, len(data))
    return out
