#include <bzlib.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "core/input_file.hpp"
#include "rosbag/bag.hpp"
#include "rosbag/ros1_index.hpp"
#include "rosbag/ros1_record.hpp"
#include "storage/byte_order.hpp"
#include "storage/compression.hpp"

namespace hueline::rosbag {
namespace {

using storage::ByteReader;
using storage::ByteView;

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint64_t kLargestChunk = 512u << 20;  // uncompressed; a file that states more is damaged or hostile
constexpr int kMostDetours = 1000;                   // a hostile index could lead around for long
// All chunks together, as of an MCAP file: this number of bytes, or so many times the size of the file.
constexpr std::uint64_t kUnpackedAnyway = std::uint64_t{8} << 30, kUnpackedShare = 64;

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
/// connections that describe them lie in chunks. The index at the end of the file is needed only behind damage. Source:
/// the ROS wiki, Bags/Format/2.0.
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

  /// Goes on behind a place at which no record begins: nothing marks where records do, but the index at the end of the
  /// file names the chunks. Returns what is to be told of it.
  Error lost(const std::string& what) {
    if (!index_) {
      index_ = read_ros1_index(file_, index_at_.value_or(0));
      for (const auto& [fields, data] : index_->connections) add_connection(fields, storage::as_bytes(data));
    }
    if (index_->chunks.contains(record_at_)) {  // it is the chunk itself that does not begin as a record
      chunk_begin_ = record_at_;
      is_chunk_whole_ = false;
    }
    std::uint64_t missing = 0;
    if (const auto begun = index_->chunks.find(chunk_begin_); begun != index_->chunks.end() && !is_chunk_whole_)
      missing = begun->second;
    const std::string count = missing > 0 ? "; " + std::to_string(missing) + " messages are missing" : std::string();
    // A length that was too large may have led past the beginning of the next chunk, but not past that of a whole one.
    const auto next = index_->chunks.lower_bound(std::max(chunk_begin_ + 1, chunk_end_));
    const bool is_all_read = next == index_->chunks.end() && index_->chunks.contains(chunk_begin_) && is_chunk_whole_;
    if (is_all_read) {
      at_ = file_.size();
      return damaged(what + "; by the file's index no messages are behind it");
    }
    if (next == index_->chunks.end() || next->first >= file_.size() || ++detours_ > kMostDetours)
      return end(ErrorCode::Truncated, what + count + "; the rest is not read");
    const Error told = damaged(what + count + "; reading goes on with the chunk at byte " +
                               std::to_string(next->first) + ", which the file's index names");
    at_ = chunk_begin_ = next->first;
    is_chunk_whole_ = false;
    return told;
  }

  /// Reads `size` bytes at the read position.
  Result<Buffer> read(std::uint64_t size) {
    if (size > file_.size() - at_) return lost("the file ends inside a record: it was cut off, or a length is wrong");
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

  /// Returns how many bytes the index of a chunk has. The recorder of August 2010, which was the first to write this
  /// version, states 20 for each message, and writes 12 as all later ones.
  static std::uint64_t size_of_index(const Ros1Header& fields, std::uint32_t stated) {
    constexpr std::uint64_t kEntry = 12, kStatedEntry = 20;
    const std::uint64_t count = fields.number<std::uint32_t>("count").value_or(0);
    return count > 0 && stated == kStatedEntry * count ? kEntry * count : stated;
  }

  std::optional<Error> read_record(std::optional<BagMessage>& message) {
    record_at_ = at_;
    if (at_ == file_.size() && !has_file_header_ && messages_ == 0)
      return end(ErrorCode::Truncated, "the file has nothing behind its first line: it was cut off");
    if (at_ == file_.size() && is_unfinished())
      return end(ErrorCode::Truncated, "the recording was not finished; all that its recorder had written is read");
    if (at_ == file_.size()) return end(ErrorCode::EndOfData, "end of the recording");
    const auto header_size = read_length();
    if (!header_size.ok()) return header_size.error();
    if (*header_size > kLargestRos1Header) return lost("no record begins here");
    const auto header = read(*header_size);
    if (!header.ok()) return header.error();
    const auto data_size = read_length();
    if (!data_size.ok()) return data_size.error();
    const Ros1Header fields(header->bytes());
    const auto op = fields.op();
    if (!fields.is_sound() || !op) return lost("no record begins here");
    if (*op == Ros1Op::Index || *op == Ros1Op::ChunkInfo || *op == Ros1Op::FileHeader) {
      if (*op == Ros1Op::FileHeader) index_at_ = fields.number<std::uint64_t>("index_pos");
      has_file_header_ |= *op == Ros1Op::FileHeader;
      const std::uint64_t size = *op == Ros1Op::Index ? size_of_index(fields, *data_size) : *data_size;
      if (size > file_.size() - at_) return lost("the file ends inside a record: it was cut off, or a length is wrong");
      at_ += size;
      return {};
    }
    if (*op == Ros1Op::Chunk) {
      chunk_begin_ = record_at_;
      is_chunk_whole_ = false;
    }
    const auto data = read(*data_size);
    if (!data.ok()) return data.error();
    if (*op == Ros1Op::Chunk) {
      is_chunk_whole_ = true;  // what is broken in it is told by itself
      chunk_end_ = at_;
      return load_chunk(fields, *data);
    }
    return take_record(*op, fields, *data, message);
  }

  /// The recorder writes where its index is when it ends. Until then its file is called .bag.active.
  bool is_unfinished() const { return index_at_ == 0; }

  std::optional<Error> load_chunk(const Ros1Header& fields, const Buffer& data) {
    const std::string compression = fields.text("compression");
    // The recorder writes the size of a chunk when it ends it. The records of one that is not compressed follow as if
    // they were in none.
    if (data.size() == 0 && is_unfinished()) {
      if (compression == "none") return {};
      return end(ErrorCode::Truncated, "the recording was not finished; its last messages, of a chunk that was to be " +
                                           compression + ", are not read");
    }
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
    const Ros1Header fields(header);
    const auto op = fields.op();
    if (!in.ok() || !fields.is_sound() || !op) {
      chunk_ = Buffer();
      return damaged("a record inside the chunk is broken; the rest of the chunk is skipped");
    }
    chunk_at_ += in.position();
    return take_record(*op, fields, chunk_.part(chunk_at_ - data.size(), data.size()), message);
  }

  void add_connection(const Ros1Header& fields, ByteView data) {
    const auto connection = fields.number<std::uint32_t>("conn");
    if (!connection) return;
    const Ros1Header about(data);
    const auto index =
        topics_.add({fields.text("topic"), drivers::ros_type(about.text("type")), drivers::RosEncoding::Ros1, {}});
    if (index) by_connection_[*connection] = *index;
  }

  std::optional<Error> take_record(Ros1Op op, const Ros1Header& fields, const Buffer& data,
                                   std::optional<BagMessage>& message) {
    const auto connection = fields.number<std::uint32_t>("conn");
    if (op == Ros1Op::Connection) add_connection(fields, data.bytes());
    if (op != Ros1Op::Message) return {};
    const auto time = fields.number<std::uint64_t>("time");  // seconds below, nanoseconds above
    const auto topic = connection ? by_connection_.find(*connection) : by_connection_.end();
    if (!time || topic == by_connection_.end())
      return damaged("a message without a time, or of a topic that the file does not describe, is skipped");
    ++messages_;
    message =
        BagMessage{topic->second, UnixTime(std::chrono::seconds(*time & 0xFFFFFFFF) + nanoseconds(*time >> 32)), data};
    return {};
  }

  InputFile file_;
  BufferPool pool_;
  std::uint64_t at_, record_at_ = 0;
  std::optional<std::uint64_t> index_at_;  // of the index at the end of the file, if the file says it; 0: not yet
  std::optional<Ros1Index> index_;         // once it was needed
  std::uint64_t chunk_begin_ = 0;          // of the last chunk that was begun
  std::uint64_t chunk_end_ = 0;            // of the last chunk that was read
  bool is_chunk_whole_ = true, has_file_header_ = false;
  std::uint64_t messages_ = 0;  // that were read
  int detours_ = 0;             // by the index
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
