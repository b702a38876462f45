#include <bzlib.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "core/input_file.hpp"
#include "rosbag/bag.hpp"
#include "storage/byte_order.hpp"
#include "storage/compression.hpp"

namespace hueline::rosbag {
namespace {

using storage::ByteReader;
using storage::ByteView;

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint64_t kLargestChunk = 512u << 20;  // uncompressed; a file that states more is damaged or hostile
constexpr std::uint32_t kLargestHeader = 1u << 20;
// All chunks together, as of an MCAP file: this number of bytes, or so many times the size of the file.
constexpr std::uint64_t kUnpackedAnyway = std::uint64_t{8} << 30, kUnpackedShare = 64;

/// What a record is.
enum class Op : std::uint8_t { Message = 2, FileHeader = 3, Index = 4, Chunk = 5, ChunkInfo = 6, Connection = 7 };

/// The fields of a record's header: "name=value", each behind its length.
class Fields {
 public:
  explicit Fields(ByteView header) {
    ByteReader in(header);
    while (in.ok() && in.remaining() > 0) {
      const std::string field = in.take_string();
      const auto equals = field.find('=');
      if (!in.ok() || equals == std::string::npos) {
        is_sound_ = false;
        return;
      }
      values_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }
  bool is_sound() const { return is_sound_; }
  std::string text(const std::string& name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? std::string() : found->second;
  }
  template <class T>
  std::optional<T> number(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end() || found->second.size() != sizeof(T)) return {};
    return ByteReader(storage::as_bytes(found->second)).take<T>();
  }
  std::optional<Op> op() const {
    const auto value = number<std::uint8_t>("op");
    return value ? std::optional(static_cast<Op>(*value)) : std::nullopt;
  }

 private:
  std::map<std::string, std::string> values_;
  bool is_sound_ = true;
};

Status unpack_bz2(ByteView packed, std::span<std::byte> out) {
  auto size = static_cast<unsigned>(out.size());
  // The library does not write to its input, though it takes it as char*.
  const int done = BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(out.data()), &size,
                                              const_cast<char*>(reinterpret_cast<const char*>(packed.data())),
                                              static_cast<unsigned>(packed.size()), 0, 0);
  if (done != BZ_OK || size != out.size())
    return Error{ErrorCode::Malformed, "bz2: broken, or not of the size that the chunk states"};
  return {};
}

/// ROS 1's recording format, version 2.0: records of a header and data, each behind its length. Messages and the
/// connections that describe them lie in chunks. The index is not needed. Source: the ROS wiki, Bags/Format/2.0.
class Ros1Bag final : public Bag {
 public:
  explicit Ros1Bag(InputFile file)
      : file_(std::move(file)), pool_(std::numeric_limits<std::size_t>::max() / 2), at_(kMagic.size()) {}

  const std::vector<BagTopic>& topics() const override { return topics_.all(); }
  Result<BagMessage> next() override {
    for (;;) {
      std::optional<BagMessage> message;
      if (!chunk_.empty()) {
        if (auto error = take_from_chunk(message)) return *error;
        if (message) return std::move(*message);
        continue;
      }
      if (ended_) return *ended_;
      if (auto error = read_record(message)) return *error;
      if (message) return std::move(*message);
    }
  }

 private:
  Error damaged(const std::string& what) const {
    return {ErrorCode::Malformed, file_.path().string() + " at byte " + std::to_string(record_at_) + ": " + what};
  }
  Error end(ErrorCode code, const std::string& what) {
    ended_ = Error{code, file_.path().string() + " at byte " + std::to_string(record_at_) + ": " + what};
    return *ended_;
  }

  /// Reads `size` bytes at the read position.
  Result<Buffer> read(std::uint64_t size) {
    if (size > file_.size() - at_) return end(ErrorCode::Truncated, "the file ends inside a record: it was cut off");
    MutableBuffer memory = pool_.acquire(static_cast<std::size_t>(size));
    if (Status done = file_.read(at_, memory.bytes()); !done.ok()) return end(done.error().code, done.error().message);
    at_ += size;
    return std::move(memory).share();
  }
  Result<std::uint32_t> read_length() {
    const auto bytes = read(4);
    if (!bytes.ok()) return bytes.error();
    return ByteReader(bytes->bytes()).take<std::uint32_t>();
  }

  std::optional<Error> read_record(std::optional<BagMessage>& message) {
    record_at_ = at_;
    if (at_ == file_.size()) return end(ErrorCode::EndOfData, "end of the recording");
    const auto header_size = read_length();
    if (!header_size.ok()) return header_size.error();
    // Nothing marks the beginning of a record, so a broken length leaves nothing to go on with.
    if (*header_size > kLargestHeader) return end(ErrorCode::Truncated, "no record begins here; the rest is not read");
    const auto header = read(*header_size);
    if (!header.ok()) return header.error();
    const auto data_size = read_length();
    if (!data_size.ok()) return data_size.error();
    const Fields fields(header->bytes());
    const auto op = fields.op();
    if (!fields.is_sound() || !op) return end(ErrorCode::Truncated, "no record begins here; the rest is not read");
    if (*op == Op::Index || *op == Op::ChunkInfo || *op == Op::FileHeader) {
      if (*data_size > file_.size() - at_) return end(ErrorCode::Truncated, "the file ends inside a record");
      at_ += *data_size;
      return {};
    }
    const auto data = read(*data_size);
    if (!data.ok()) return data.error();
    if (*op == Op::Chunk) return load_chunk(fields, *data);
    return take_record(*op, fields, *data, message);
  }

  std::optional<Error> load_chunk(const Fields& fields, const Buffer& data) {
    const std::string compression = fields.text("compression");
    const auto size = fields.number<std::uint32_t>("size");
    if (!size || *size > kLargestChunk) return damaged("a chunk without a size that can be true is skipped");
    if (compression == "none") {
      chunk_ = data;
    } else {
      if ((unpacked_ += *size) > std::max(kUnpackedAnyway, kUnpackedShare * file_.size()))
        return end(ErrorCode::Unsupported,
                   "the chunks unpack to far more than the file's size: it is not read further");
      MutableBuffer memory = pool_.acquire(*size);
      Status done = compression == "bz2" ? unpack_bz2(data.bytes(), memory.bytes())
                                         : storage::decompress(compression, data.bytes(), memory.bytes());
      if (!done.ok()) return damaged(done.error().message + "; the chunk is skipped");
      chunk_ = std::move(memory).share();
    }
    chunk_at_ = 0;
    return {};
  }

  std::optional<Error> take_from_chunk(std::optional<BagMessage>& message) {
    if (chunk_at_ == chunk_.size()) {
      chunk_ = Buffer();
      return {};
    }
    ByteReader in(chunk_.bytes().subspan(chunk_at_));
    const ByteView header = in.take_bytes(in.take<std::uint32_t>());
    const ByteView data = in.take_bytes(in.take<std::uint32_t>());
    const Fields fields(header);
    const auto op = fields.op();
    if (!in.ok() || !fields.is_sound() || !op) {
      chunk_ = Buffer();
      return damaged("a record inside the chunk is broken; the rest of the chunk is skipped");
    }
    chunk_at_ += in.position();
    return take_record(*op, fields, chunk_.part(chunk_at_ - data.size(), data.size()), message);
  }

  std::optional<Error> take_record(Op op, const Fields& fields, const Buffer& data,
                                   std::optional<BagMessage>& message) {
    const auto connection = fields.number<std::uint32_t>("conn");
    if (op == Op::Connection && connection) {
      const Fields about(data.bytes());
      const auto index =
          topics_.add({fields.text("topic"), drivers::ros_type(about.text("type")), drivers::RosEncoding::Ros1, {}});
      if (index) by_connection_[*connection] = *index;
      return {};
    }
    if (op != Op::Message) return {};
    const auto time = fields.number<std::uint64_t>("time");  // seconds below, nanoseconds above
    const auto topic = connection ? by_connection_.find(*connection) : by_connection_.end();
    if (!time || topic == by_connection_.end())
      return damaged("a message without a time, or of a topic that the file does not describe, is skipped");
    message =
        BagMessage{topic->second, UnixTime(std::chrono::seconds(*time & 0xFFFFFFFF) + nanoseconds(*time >> 32)), data};
    return {};
  }

  InputFile file_;
  BufferPool pool_;
  std::uint64_t at_, record_at_ = 0;
  Buffer chunk_;
  std::size_t chunk_at_ = 0;
  std::uint64_t unpacked_ = 0;
  TopicList topics_;
  std::map<std::uint32_t, std::size_t> by_connection_;
  std::optional<Error> ended_;
};

}  // namespace

Result<std::unique_ptr<Bag>> open_ros1_bag(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  std::byte magic[kMagic.size()];
  if (file->size() < sizeof magic) return Error{ErrorCode::Truncated, path.string() + " is too short for a recording"};
  if (Status done = file->read(0, magic); !done.ok()) return done.error();
  if (!std::ranges::equal(magic, storage::as_bytes(kMagic)))
    return Error{ErrorCode::Unsupported,
                 path.string() + " is not a recording of ROS 1, version 2.0: convert older ones with rosbag fix"};
  return std::unique_ptr<Bag>(std::make_unique<Ros1Bag>(std::move(*file)));
}

}  // namespace hueline::rosbag
