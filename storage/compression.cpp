#include "storage/compression.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <memory>
#include <string>

namespace hueline::storage {
namespace {

Error failed(const char* what, const char* why) { return {ErrorCode::Malformed, std::string(what) + ": " + why}; }

Status compress_lz4(ByteView all, Bytes& out) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.contentSize = all.size();
  preferences.frameInfo.blockSizeID = LZ4F_max4MB;
  const std::size_t at = out.size();
  out.resize(at + LZ4F_compressFrameBound(all.size(), &preferences));
  const std::size_t size = LZ4F_compressFrame(out.data() + at, out.size() - at, all.data(), all.size(), &preferences);
  if (LZ4F_isError(size)) return failed("lz4", LZ4F_getErrorName(size));
  out.resize(at + size);
  return {};
}

Status compress_zstd(ByteView all, Bytes& out) {
  const std::size_t at = out.size();
  out.resize(at + ZSTD_compressBound(all.size()));
  // Level 1, so that the recorder does not fall behind the sensors.
  const std::size_t size = ZSTD_compress(out.data() + at, out.size() - at, all.data(), all.size(), 1);
  if (ZSTD_isError(size)) return failed("zstd", ZSTD_getErrorName(size));
  out.resize(at + size);
  return {};
}

Status decompress_lz4(ByteView in, std::span<std::byte> out) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) return failed("lz4", "no memory");
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw,
                                                                                     &LZ4F_freeDecompressionContext);
  std::size_t done = 0;
  while (!in.empty()) {
    std::size_t room = out.size() - done, taken = in.size();
    const std::size_t hint = LZ4F_decompress(raw, out.data() + done, &room, in.data(), &taken, nullptr);
    if (LZ4F_isError(hint)) return failed("lz4", LZ4F_getErrorName(hint));
    done += room;
    in = in.subspan(taken);
    if (hint == 0) break;  // end of the frame
    if (room == 0 && taken == 0) break;
  }
  if (done != out.size() || !in.empty()) return failed("lz4", "not of the size that the chunk states");
  return {};
}

}  // namespace

const char* mcap_name(Compression compression) {
  switch (compression) {
    case Compression::None:
      return "";
    case Compression::Lz4:
      return "lz4";
    case Compression::Zstd:
      return "zstd";
  }
  return "?";
}

Status compress(Compression compression, std::span<const ByteView> pieces, Bytes& out) {
  Bytes all;
  std::size_t size = 0;
  for (const ByteView piece : pieces) size += piece.size();
  all.reserve(size);
  for (const ByteView piece : pieces) append(all, piece);
  return compression == Compression::Lz4 ? compress_lz4(all, out) : compress_zstd(all, out);
}

Status decompress(const std::string& mcap_name, ByteView compressed, std::span<std::byte> out) {
  if (mcap_name == "lz4") return decompress_lz4(compressed, out);
  if (mcap_name == "zstd") {
    const std::size_t size = ZSTD_decompress(out.data(), out.size(), compressed.data(), compressed.size());
    if (ZSTD_isError(size)) return failed("zstd", ZSTD_getErrorName(size));
    if (size != out.size()) return failed("zstd", "not of the size that the chunk states");
    return {};
  }
  return Error{ErrorCode::Unsupported, "chunk compression \"" + mcap_name + "\" is none of lz4, zstd, none"};
}

}  // namespace hueline::storage
