#include "rosbag/bag.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <system_error>

#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "core/packed_file.hpp"
#include "rosbag/packed_file.hpp"
#include "rosbag/turned_bag.hpp"
#include "storage/mcap_format.hpp"

namespace hueline::rosbag {
namespace {

enum class Kind : std::uint8_t { None, Mcap, Sqlite, Ros1, Compressed };

// ROS 1 called its recordings otherwise before version 1.3.
constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16}, kRos1Magic = "#ROSBAG V",
                                                                  kOldRos1Magic = "#ROSRECORD V";

Kind kind_of(std::string_view first, const std::filesystem::path& path) {
  const auto mcap =
      std::string_view(reinterpret_cast<const char*>(storage::kMcapMagic.data()), storage::kMcapMagic.size());
  if (first.starts_with(mcap)) return Kind::Mcap;
  if (first.starts_with(kSqliteMagic)) return Kind::Sqlite;
  if (first.starts_with(kRos1Magic) || first.starts_with(kOldRos1Magic)) return Kind::Ros1;
  return is_packed_name(path.filename().string()) && first.starts_with(kZstdMagic) ? Kind::Compressed : Kind::None;
}

Result<Kind> kind_of(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  std::array<char, 16> first{};
  const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(file->size(), first.size()));
  if (Status done = file->read(0, std::as_writable_bytes(std::span(first)).first(size)); !done.ok())
    return done.error();
  return kind_of(std::string_view(first.data(), size), path);
}

Result<std::unique_ptr<Bag>> open_format(const std::filesystem::path& path) {
  const auto kind = kind_of(path);
  if (!kind.ok()) return kind.error();
  switch (*kind) {
    case Kind::Mcap:
      return open_mcap_bag(path);
    case Kind::Sqlite:
      return open_sqlite_bag(path);
    case Kind::Ros1:
      return open_ros1_bag(path);
    case Kind::Compressed:
      return Error{ErrorCode::Unsupported, path.string() + " is compressed as a whole: unpack it with zstd -d " +
                                               path.string() + " (hueline import does so itself)"};
    case Kind::None:
      break;
  }
  return Error{ErrorCode::Unsupported,
               path.string() + " is no recording of ROS: neither MCAP, nor SQLite (.db3), nor a .bag of version 2.0"};
}

Result<std::unique_ptr<Bag>> open_file(const std::filesystem::path& path) {
  auto bag = open_format(path);
  if (!bag.ok()) return bag;
  return turned_bag(std::move(*bag));
}

/// ROS 1 adds it to the name of a file, NAME.bag, until its recording ends.
constexpr std::string_view kUnfinished = ".active";

/// The order of the files of a folder: name_2 comes before name_10.
std::pair<std::string, unsigned long long> numbered(const std::filesystem::path& path) {
  const bool is_unfinished = path.extension() == kUnfinished;
  const std::string stem = (is_unfinished ? path.stem() : path).stem().string();
  const auto digits = stem.find_last_not_of("0123456789") + 1;
  if (digits == stem.size() || stem.size() - digits > 18) return {stem, 0};
  return {stem.substr(0, digits), std::stoull(stem.substr(digits))};
}

/// Returns whether ROS 1 has split one recording into these files: NAME_0.bag, NAME_1.bag and so on, with a date in the
/// name that may be each file's own.
bool are_parts(const std::vector<std::filesystem::path>& files) {
  std::set<unsigned long long> numbers;
  for (const auto& path : files)
    if (const auto [name, number] = numbered(path); name.ends_with('_')) numbers.insert(number);
  return files.size() == 1 || numbers.size() == files.size();
}

/// The files of a folder as one recording.
class FolderBag final : public Bag {
 public:
  FolderBag(std::vector<std::filesystem::path> files, std::unique_ptr<Bag> first)
      : files_(std::move(files)), current_(std::move(first)) {
    take_topics();
  }
  const std::vector<BagTopic>& topics() const override { return topics_.all(); }
  Result<BagMessage> next() override {
    for (;;) {
      if (ended_) return *ended_;
      auto message = current_->next();
      take_topics();
      if (message.ok()) {
        const auto topic = numbers_[message->topic];
        if (!topic) return Error{ErrorCode::Malformed, "a message of one topic too many was skipped"};
        message->topic = *topic;
        return message;
      }
      if (message.error().code == ErrorCode::Malformed) return message;
      if (Status opened = open_next(message.error()); !opened.ok()) return opened.error();
    }
  }

 private:
  void take_topics() {
    for (std::size_t i = numbers_.size(); i < current_->topics().size(); ++i)
      numbers_.push_back(topics_.add(current_->topics()[i]));
  }
  /// Opens the file behind the one that ended with `why`. A file that was cut is reported as damage, and the next one
  /// is read.
  Status open_next(const Error& why) {
    numbers_.clear();
    const bool is_whole = why.code == ErrorCode::EndOfData;
    if (++at_ == files_.size()) {
      ended_ = why;
      if (is_whole && damage_) ended_ = damage_;
      return *ended_;
    }
    if (!is_whole && !damage_) damage_ = why;
    auto opened = open_file(files_[at_]);
    if (!opened.ok()) {
      ended_ = opened.error();
      return *ended_;
    }
    current_ = std::move(*opened);
    take_topics();
    if (is_whole) return {};
    return Error{ErrorCode::Malformed, why.message + "; the next file is read"};
  }

  std::vector<std::filesystem::path> files_;
  std::unique_ptr<Bag> current_;
  std::size_t at_ = 0;
  TopicList topics_;
  std::vector<std::optional<std::size_t>> numbers_;  // of the current file's topics in topics_
  std::optional<Error> ended_, damage_;
};

Result<std::unique_ptr<Bag>> open_folder(const std::filesystem::path& path) {
  constexpr std::size_t kMostFiles = 100'000;
  std::vector<std::filesystem::path> files, ros1_files;
  const auto names = list_folder(path);
  if (!names.ok()) return names.error();
  for (const std::string& name : *names) {
    // What is unpacked beside the packed file, as zstd -d leaves it, is read instead.
    const bool is_packed = is_packed_name(name) && !name.substr(0, name.rfind('.')).ends_with(".bag");
    const bool is_unpacked_too = is_packed && holds(path, name.substr(0, name.rfind('.')));
    const bool is_named = is_packed || name.ends_with(".db3") || name.ends_with(".mcap");
    if (is_named && !is_unpacked_too && files.size() < kMostFiles) files.push_back(path / name);
    if ((name.ends_with(".bag") || name.ends_with(".bag.active")) && ros1_files.size() < kMostFiles)
      ros1_files.push_back(path / name);
  }
  if (files.empty() && ros1_files.empty())
    return Error{ErrorCode::Unsupported,
                 path.string() + " is a folder without a recording: no file in it ends with .db3, .mcap or .bag"};
  if (files.empty()) {
    // ROS 1 does not make a folder of each recording, so several may lie in one.
    if (!are_parts(ros1_files))
      return Error{ErrorCode::Unsupported,
                   path.string() +
                       " has several recordings of ROS 1: name one of them. They are read as the parts of "
                       "one if their names end with _0.bag, _1.bag and so on"};
    files = std::move(ros1_files);
  }
  std::ranges::sort(files, {}, numbered);
  auto first = open_file(files.front());
  if (!first.ok()) return first.error();
  return std::unique_ptr<Bag>(std::make_unique<FolderBag>(std::move(files), std::move(*first)));
}

}  // namespace

std::optional<std::size_t> TopicList::add(BagTopic topic) {
  const std::pair key(topic.name, topic.type);
  if (const auto found = known_.find(key); found != known_.end()) return found->second;
  if (all_.size() == kMost) return {};
  all_.push_back(std::move(topic));
  return known_[key] = all_.size() - 1;
}

Result<std::unique_ptr<Bag>> open_bag(const std::filesystem::path& path) {
  return is_folder(path) ? open_folder(path) : open_file(path);
}

bool is_bag(const std::filesystem::path& path) {
  // A drive of hueline is a folder with MCAP files, too.
  if (holds(path, "drive.mcap")) return false;
  const bool has_files = is_folder(path);
  if (!has_files) {
    const auto kind = kind_of(path);
    if (!kind.ok() || *kind == Kind::None) return false;
    if (*kind != Kind::Mcap) return true;
  }
  const auto bag = open_bag(path);
  if (!bag.ok()) return has_files && bag.error().code != ErrorCode::Unsupported;
  const auto is_of_others = [](const BagTopic& one) { return one.trouble != kIsOfDrive && one.trouble != kIsOfView; };
  constexpr int kMostDamages = 1000;
  for (int damages = 0; damages < kMostDamages; ++damages) {
    const auto message = (*bag)->next();
    if (message.ok()) return is_of_others((*bag)->topics()[message->topic]);
    if (message.error().code != ErrorCode::Malformed) break;
  }
  return std::ranges::any_of((*bag)->topics(), is_of_others);
}

}  // namespace hueline::rosbag
