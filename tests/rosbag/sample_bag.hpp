#pragma once

#include <sqlite3.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/ros/ros_message.hpp"
#include "storage/byte_order.hpp"
#include "storage/mcap_writer.hpp"

/// Small recordings of ROS, written from the documents of their formats without the readers' code.
namespace hueline::test {

/// Writes the fields of a message.
class RosWriter {
 public:
  explicit RosWriter(drivers::RosEncoding encoding) : is_cdr_(encoding == drivers::RosEncoding::Cdr) {
    if (is_cdr_) bytes_ = std::string("\x00\x01\x00\x00", 4);
  }
  template <class T>
  RosWriter& put(T value) {
    if (is_cdr_)
      while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_ += '\0';
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  RosWriter& text(const std::string& s) {
    put(static_cast<std::uint32_t>(s.size() + (is_cdr_ ? 1 : 0)));
    bytes_ += s;
    if (is_cdr_) bytes_ += '\0';
    return *this;
  }
  RosWriter& raw(std::string_view s) {
    bytes_ += s;
    return *this;
  }
  RosWriter& sequence(std::string_view s) { return put(static_cast<std::uint32_t>(s.size())).raw(s); }
  RosWriter& time(std::int64_t ns) {
    return put(static_cast<std::int32_t>(ns / 1'000'000'000)).put(static_cast<std::uint32_t>(ns % 1'000'000'000));
  }
  RosWriter& header(std::int64_t ns, const std::string& frame) {
    if (!is_cdr_) put(std::uint32_t{7});
    return time(ns).text(frame);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  bool is_cdr_;
  std::string bytes_;
};

struct SampleMessage {
  std::string topic, type;  ///< the type as ROS 1 writes it
  std::int64_t time_ns;
  std::string bytes;
};

/// "velodyne_msgs/VelodyneScan" as ROS 2 writes it.
inline std::string ros2_type(const std::string& type) {
  const auto slash = type.find('/');
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

/// The numbers of the topics, by their first message.
inline std::vector<std::string> topics_of(const std::vector<SampleMessage>& messages) {
  std::vector<std::string> out;
  for (const SampleMessage& m : messages)
    if (std::find(out.begin(), out.end(), m.topic) == out.end()) out.push_back(m.topic);
  return out;
}

inline void write_mcap(const std::filesystem::path& path, const std::vector<SampleMessage>& messages,
                       storage::Compression compression, const std::string& encoding = "cdr") {
  storage::McapWriter::Config config;
  config.profile = "ros2";
  config.compression = compression;
  config.chunk_bytes = 4096;
  config.if_exists = IfExists::Replace;
  auto writer = storage::McapWriter::create(path, config);
  if (!writer.ok()) std::abort();
  std::vector<std::string> known;
  for (const SampleMessage& m : messages) {
    auto at = std::find(known.begin(), known.end(), m.topic);
    if (at == known.end()) {
      const auto schema = writer->add_schema({0, ros2_type(m.type), "ros2msg", ""});
      at = known.insert(known.end(), m.topic);
      const auto id = static_cast<std::uint16_t>(at - known.begin());
      if (!schema.ok() || !writer->add_channel({id, *schema, m.topic, encoding, {}}).ok()) std::abort();
    }
    const auto time = static_cast<std::uint64_t>(m.time_ns);
    const storage::McapChunk::Message head{static_cast<std::uint16_t>(at - known.begin()), 0, time, time};
    if (!writer->write(head, storage::as_bytes(m.bytes)).ok()) std::abort();
  }
  if (!writer->close().ok()) std::abort();
}

inline void write_sqlite(const std::filesystem::path& path, const std::vector<SampleMessage>& messages) {
  std::filesystem::remove(path);
  sqlite3* database = nullptr;
  const auto run = [&](const std::string& sql) {
    if (sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) std::abort();
  };
  if (sqlite3_open(path.c_str(), &database) != SQLITE_OK) std::abort();
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT "
      "NULL,offered_qos_profiles TEXT NOT NULL)");
  run("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB "
      "NOT NULL)");
  const auto topics = topics_of(messages);
  run("BEGIN");
  for (const SampleMessage& m : messages) {
    const auto id = std::find(topics.begin(), topics.end(), m.topic) - topics.begin() + 1;
    run("INSERT OR IGNORE INTO topics VALUES(" + std::to_string(id) + ",'" + m.topic + "','" + ros2_type(m.type) +
        "','cdr','')");
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(database, "INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", -1, &insert, nullptr);
    sqlite3_bind_int64(insert, 1, id);
    sqlite3_bind_int64(insert, 2, m.time_ns);
    sqlite3_bind_blob(insert, 3, m.bytes.data(), static_cast<int>(m.bytes.size()), SQLITE_STATIC);
    if (sqlite3_step(insert) != SQLITE_DONE) std::abort();
    sqlite3_finalize(insert);
  }
  run("COMMIT");
  sqlite3_close(database);
}

/// A text behind its length.
inline std::string sized(const std::string& s) {
  const auto size = static_cast<std::uint32_t>(s.size());
  return std::string(reinterpret_cast<const char*>(&size), 4) + s;
}
using Ros1Fields = std::vector<std::pair<std::string, std::string>>;
inline std::string ros1_fields(const Ros1Fields& fields) {
  std::string out;
  for (const auto& [name, value] : fields) out += sized(name + "=" + value);
  return out;
}
/// A record of ROS 1's format: fields of the header, then data.
inline std::string ros1_record(const Ros1Fields& fields, const std::string& data) {
  return sized(ros1_fields(fields)) + sized(data);
}
template <class T>
std::string raw_of(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

/// Packs a chunk; `compression` is none, lz4 or bz2. `pack` makes its bytes.
inline std::string ros1_bag(const std::vector<SampleMessage>& messages, const std::string& compression,
                            const std::function<std::string(const std::string&)>& pack) {
  std::string out = "#ROSBAG V2.0\n";
  out += ros1_record({{"op", "\x03"}, {"index_pos", raw_of(std::uint64_t{0})}}, std::string(100, ' '));
  const auto topics = topics_of(messages);
  std::vector<bool> told(topics.size());
  for (std::size_t begin = 0; begin < messages.size(); begin += 2) {
    std::string chunk;
    for (std::size_t i = begin; i < messages.size() && i < begin + 2; ++i) {
      const SampleMessage& m = messages[i];
      const auto id = static_cast<std::uint32_t>(std::find(topics.begin(), topics.end(), m.topic) - topics.begin());
      if (!told[id])
        chunk += ros1_record({{"op", "\x07"}, {"conn", raw_of(id)}, {"topic", m.topic}},
                             ros1_fields({{"topic", m.topic}, {"type", m.type}, {"md5sum", "*"}}));
      told[id] = true;
      const std::uint64_t time = static_cast<std::uint64_t>(m.time_ns / 1'000'000'000) |
                                 static_cast<std::uint64_t>(m.time_ns % 1'000'000'000) << 32U;
      chunk += ros1_record({{"op", "\x02"}, {"conn", raw_of(id)}, {"time", raw_of(time)}}, m.bytes);
    }
    const auto size = static_cast<std::uint32_t>(chunk.size());
    out += ros1_record({{"op", "\x05"}, {"compression", compression}, {"size", raw_of(size)}}, pack(chunk));
    out +=
        ros1_record({{"op", "\x04"}, {"ver", raw_of(std::uint32_t{1})}, {"conn", raw_of(std::uint32_t{0})}}, "index");
  }
  // Where the index of the connections and chunks would be, by which the file is finished.
  constexpr std::string_view kIndexField = "index_pos=";
  out.replace(out.find(kIndexField) + kIndexField.size(), sizeof(std::uint64_t), raw_of(std::uint64_t{out.size()}));
  return out;
}

}  // namespace hueline::test
