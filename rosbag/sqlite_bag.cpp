#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/input_file.hpp"
#include "rosbag/bag.hpp"
#include "rosbag/packed_message.hpp"

namespace hueline::rosbag {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct EndStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, EndStatement>;

/// Returns the path as SQLite's form of a URI needs it.
std::string uri_of(const std::filesystem::path& path, bool is_alone) {
  constexpr const char* kHex = "0123456789ABCDEF";
  std::string out = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto u = static_cast<unsigned char>(c);
    const bool is_plain = (u >= 'a' && u <= 'z') || (u >= 'A' && u <= 'Z') || (u >= '0' && u <= '9') || c == '/' ||
                          c == '.' || c == '_' || c == '-';
    if (is_plain)
      out += c;
    else
      ((out += '%') += kHex[u >> 4U]) += kHex[u & 15U];
  }
  // A file that says of itself that nobody changes it is opened without locks and without files beside it, so it may
  // lie on a medium that cannot be written.
  return out + (is_alone ? "?mode=ro&immutable=1" : "?mode=ro");
}

std::string column_text(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text ? std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(row, column))) : std::string();
}

/// Checks that the file is as long as it says: SQLite takes pages behind the end for zeros, and the messages in them
/// would be wrong without a word. Source: the SQLite database file format, 1.3.
Status check_length(const InputFile& file) {
  std::array<std::byte, 100> head{};
  if (Status done = file.read(0, head); !done.ok()) return done;
  const auto at = [&](std::size_t offset, std::size_t bytes) {  // big endian
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | std::to_integer<std::uint64_t>(head[offset + i]);
    return value;
  };
  const std::uint64_t page = at(16, 2) == 1 ? 65536 : at(16, 2), pages = at(28, 4);
  // Only writers that keep the number of pages write the same change counter twice.
  if (at(24, 4) != at(92, 4) || page * pages <= file.size()) return {};
  return Error{ErrorCode::Truncated, file.path().string() + " was cut off: it has " + std::to_string(file.size()) +
                                         " bytes of " + std::to_string(page * pages) +
                                         ". What is whole can be saved with: sqlite3 " + file.path().string() +
                                         " .recover | sqlite3 whole.db3"};
}

/// rosbag2's SQLite storage: tables `topics` and `messages`.
class SqliteBag final : public Bag {
 public:
  SqliteBag(std::string name, InputFile file, Database database)
      : name_(std::move(name)), file_(std::move(file)), database_(std::move(database)) {}

  Status begin() {
    if (Status done = read_topics(); !done.ok()) return done;
    // In the order in which they were written, which is nearly that of their times. An order by time would need the
    // index, which other programs leave out, or all messages in memory.
    return prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY rowid", messages_);
  }

  const std::vector<BagTopic>& topics() const override { return topics_.all(); }
  Result<BagMessage> next() override {
    if (ended_) return *ended_;
    const int step = sqlite3_step(messages_.get());
    if (step == SQLITE_DONE) return end({ErrorCode::EndOfData, "end of " + name_});
    if (step != SQLITE_ROW) return end(failed(ErrorCode::Truncated));
    ++read_;
    const auto topic = by_id_.find(sqlite3_column_int64(messages_.get(), 0));
    const UnixTime received(nanoseconds(sqlite3_column_int64(messages_.get(), 1)));
    const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(messages_.get(), 2));
    const std::span<const std::byte> bytes(
        data, data ? static_cast<std::size_t>(sqlite3_column_bytes(messages_.get(), 2)) : 0);
    if (topic == by_id_.end())
      return Error{ErrorCode::Malformed, name_ + ": message " + std::to_string(read_) +
                                             " is of a topic that the file does not describe; it is skipped"};
    if (!is_packed(bytes)) return BagMessage{topic->second, received, Buffer::copy_of(bytes)};
    auto whole = unpacked(bytes);
    if (!whole.ok())
      return Error{ErrorCode::Malformed,
                   name_ + ": message " + std::to_string(read_) + ": " + whole.error().message + "; it is skipped"};
    return BagMessage{topic->second, received, std::move(*whole)};
  }

 private:
  Error failed(ErrorCode code) const {
    return {code, name_ + ": " + sqlite3_errmsg(database_.get()) + "; " + std::to_string(read_) +
                      " messages were read before"};
  }
  Error end(Error error) {
    ended_ = error;
    return error;
  }
  Status prepare(const char* text, Statement& out) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), text, -1, &statement, nullptr) != SQLITE_OK)
      return Error{ErrorCode::Unsupported,
                   name_ + " is a database, but not a recording of rosbag2: " + sqlite3_errmsg(database_.get())};
    out.reset(statement);
    return {};
  }
  Status read_topics() {
    // A hostile file could name a view `messages` that never ends.
    Statement tables;
    if (Status done = prepare("SELECT name FROM sqlite_schema WHERE type='table'", tables); !done.ok()) return done;
    std::set<std::string> found;
    while (sqlite3_step(tables.get()) == SQLITE_ROW && found.size() < 100) found.insert(column_text(tables.get(), 0));
    if (!found.contains("topics") || !found.contains("messages"))
      return Error{ErrorCode::Unsupported,
                   name_ + " is a database, but not a recording of rosbag2: it has no tables topics and messages"};
    Statement topics;
    if (Status done = prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id", topics);
        !done.ok())
      return done;
    int step = SQLITE_ROW;
    while ((step = sqlite3_step(topics.get())) == SQLITE_ROW) {
      BagTopic topic{
          column_text(topics.get(), 1), drivers::ros_type(column_text(topics.get(), 2)), drivers::RosEncoding::Cdr, {}};
      const std::string format = column_text(topics.get(), 3);
      // Converters leave the format empty.
      if (format == "ros1")
        topic.encoding = drivers::RosEncoding::Ros1;
      else if (format != "cdr" && !format.empty())
        topic.trouble = "its messages are serialised as \"" + format + "\"";
      if (const auto index = topics_.add(std::move(topic))) by_id_[sqlite3_column_int64(topics.get(), 0)] = *index;
    }
    return step == SQLITE_DONE ? Status() : failed(ErrorCode::Malformed);
  }

  std::string name_;
  InputFile file_;  // protects the file from being overwritten by this program while it is read
  Database database_;
  Statement messages_;  // is ended before the database is closed
  TopicList topics_;
  std::map<std::int64_t, std::size_t> by_id_;
  std::uint64_t read_ = 0;
  std::optional<Error> ended_;
};

}  // namespace

Result<std::unique_ptr<Bag>> open_sqlite_bag(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  if (Status here = file->check_on_this_computer(); !here.ok()) return here.error();
  std::error_code ignored;
  const bool is_alone = !std::filesystem::exists(path.string() + "-wal", ignored);
  if (is_alone)
    if (Status whole = check_length(*file); !whole.ok()) return whole.error();
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open_v2(uri_of(path, is_alone).c_str(), &raw,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database(raw);
  if (opened != SQLITE_OK)
    return Error{ErrorCode::Io, path.string() + ": " + (raw ? sqlite3_errmsg(raw) : "no memory for a database")};
  sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, static_cast<int>(kLargestMessage));
  sqlite3_exec(raw, "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
  auto bag = std::make_unique<SqliteBag>(path.string(), std::move(*file), std::move(database));
  if (Status begun = bag->begin(); !begun.ok()) return begun.error();
  return std::unique_ptr<Bag>(std::move(bag));
}

}  // namespace hueline::rosbag
