#include "apps/inspect/inspect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "apps/exit_code.hpp"
#include "apps/inspect/foreign_file.hpp"
#include "apps/log.hpp"
#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "core/json_text.hpp"
#include "core/packed_file.hpp"
#include "core/printable.hpp"
#include "drivers/can/blf.hpp"
#include "drivers/can/can_log.hpp"
#include "drivers/trajectory/smrmsg_file.hpp"
#include "drivers/transport/can_capture.hpp"
#include "drivers/transport/capture_file.hpp"
#include "rosbag/bag.hpp"
#include "runtime/recording.hpp"
#include "storage/cloud_file.hpp"
#include "storage/e57_pages.hpp"
#include "storage/text_cloud.hpp"

namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;

/// Long enough for a whole message of any device, behind the comments at the head of a log.
constexpr std::uint64_t kFirstBytes = 65536;

/// How the names of clouds end that are text; their content alone does not tell them from other tables of numbers.
constexpr std::array<const char*, 5> kTextClouds{".xyz", ".pts", ".txt", ".asc", ".csv"};

Result<std::string> first_bytes(const InputFile& file) {
  std::string head(static_cast<std::size_t>(std::min(kFirstBytes, file.size())), '\0');
  if (Status done = file.read(0, std::as_writable_bytes(std::span(head))); !done.ok()) return done.error();
  return head;
}

/// Returns whether a file's name has this ending, in small letters or large ones.
bool ends_with(std::string_view path, std::string_view ending) {
  const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return path.size() >= ending.size() &&
         std::ranges::equal(path.substr(path.size() - ending.size()), ending, {}, small, small);
}

/// Finds whose bytes a file holds: by what is in it, and by its name among those that both fit or if nothing fits.
const drivers::DeviceType* type_of_log(drivers::DeviceTypes types, const std::string& path, std::string_view first) {
  const drivers::DeviceType* by_bytes = nullptr;
  const drivers::DeviceType* by_name = nullptr;
  for (const drivers::DeviceType* type : types) {
    const drivers::DeviceFiles::Log& log = type->files.log;
    if (!log.format) continue;
    const bool is_named = ends_with(path, log.ending);
    const bool fits = log.is_beginning(first);
    if (is_named && fits) return type;
    if (fits && !by_bytes) by_bytes = type;
    if (is_named && !by_name) by_name = type;
  }
  return by_bytes ? by_bytes : by_name;
}

bool is_log_of_device(drivers::DeviceTypes types, std::string_view first) {
  return std::ranges::any_of(types, [&](const drivers::DeviceType* type) {
    return type->files.log.format && type->files.log.is_beginning(first);
  });
}

/// Writes JSON as indented lines for people, one line for each value. A list of plain values stays in one line.
void print(const Json& json, int depth, std::string& out) {
  const std::string indent(static_cast<std::size_t>(2 * depth), ' ');
  for (const auto& [key, value] : json.items()) {
    if (value.is_object() && !value.empty()) {
      out += fmt::format("{}{}\n", indent, key);
      print(value, depth + 1, out);
    } else if (value.is_array() && !value.empty() && value.front().is_object()) {
      for (const auto& one : value) {
        out += fmt::format("{}{}\n", indent, key);
        print(one, depth + 1, out);
      }
    } else {
      out += fmt::format("{}{:24} {}\n", indent, printable(key),
                         printable(value.is_string() ? value.get<std::string>() : json_text(value)));
    }
  }
}

}  // namespace

int show(const Inspection& inspection, bool as_json) {
  if (inspection.found) {
    if (as_json) {
      Json out = *inspection.found;
      if (!inspection.trouble.ok()) out["error"] = inspection.trouble.error().message;
      std::fputs((json_text(out, 2) + "\n").c_str(), stdout);
    } else {
      std::string text;
      print(*inspection.found, 0, text);
      std::fputs(text.c_str(), stdout);
    }
  }
  if (inspection.trouble.ok()) return kDone;
  log_error(inspection.trouble.error().message);
  return inspection.trouble.error().code == ErrorCode::Invalid ? kWrongUse : kInputUnreadable;
}

Inspection inspect_file(const std::string& named, drivers::DeviceTypes types, const std::string& dbc_path) {
  const std::string path = runtime::drive_file(named);
  const bool has_files = is_folder(path);
  if (has_files && rosbag::is_bag(path)) return inspect_bag(path);
  if (has_files)
    return {nullptr, Error{ErrorCode::Io, path + " is a folder without drive.mcap in it, and without a recording of "
                                                 "ROS: give a file, or a drive's folder"}};
  const auto file = InputFile::open(path);
  if (!file.ok()) return {nullptr, file.error()};
  if (file->size() == 0) return {nullptr, Error{ErrorCode::Truncated, path + " is empty"}};
  const Result<std::string> first = first_bytes(*file);
  if (!first.ok()) return {nullptr, first.error()};
  const std::string head = first->substr(0, 64);
  const auto begins = [&](std::string_view magic) { return std::string_view(head).substr(0, magic.size()) == magic; };
  using namespace std::string_view_literals;
  if (begins("\x89MCAP0\r\n"sv)) return inspect_mcap(path);
  if (begins("#ROSBAG V"sv) || begins("#ROSRECORD V"sv) || begins("SQLite format 3\0"sv)) return inspect_bag(path);
  if (begins("LASF"sv)) return inspect_las(path);
  if (begins(storage::kE57Signature)) return inspect_e57(path);
  if (drivers::is_capture(head))
    return drivers::is_can_capture(path) ? inspect_can_log(path, dbc_path) : inspect_capture_file(path, types);
  // Some programs write neither the comment nor VERSION in front of the fields.
  if (begins("# .PCD"sv) || (ends_with(path, ".pcd") && (begins("#"sv) || begins("VERSION"sv) || begins("FIELDS"sv))))
    return inspect_cloud(path, "PCD");
  if (storage::is_ply(head)) return inspect_cloud(path, "PLY");
  if (begins("\x93NUMPY"sv)) return inspect_cloud(path, "NumPy array");
  if (ends_with(path, ".yaml") || ends_with(path, ".yml")) return inspect_yaml(path);
  if (ends_with(path, ".dbc")) return inspect_dbc(path);
  // A log of a CAN bus: an ASC file begins with its date, a line of candump with its time or its interface, a trace of
  // version 1.1 or later with that, a BLF with a signature, a table with the names of its columns. The name counts if
  // nothing else fits: receivers' logs in ASCII have it, too.
  const bool is_device_log = is_log_of_device(types, *first);
  if (const std::string foreign = foreign_file(*first); !is_device_log && !foreign.empty())
    return {nullptr, Error{ErrorCode::Unsupported, path + " " + foreign}};
  const bool is_named_cloud = std::ranges::any_of(kTextClouds, [&](const char* one) { return ends_with(path, one); });
  if (!is_device_log && (storage::is_ptx(*first) || (is_named_cloud && !storage::text_cloud_kind(*first).empty())))
    return inspect_text_cloud(path);
  const bool is_named_can = (ends_with(path, ".asc") || ends_with(path, ".trc")) && !is_device_log;
  if (drivers::is_blf(head) || is_named_can || begins("date "sv) || begins(";$FILEVERSION="sv) ||
      begins("$STARTTIME="sv) || drivers::CanLogTable::is_head(std::string_view(*first).substr(0, first->find('\n'))) ||
      drivers::is_candump(*first))
    return inspect_can_log(path, dbc_path);
  if (!is_device_log && drivers::is_smrmsg(std::as_bytes(std::span(*first)))) return inspect_smrmsg(path);
  if (const drivers::DeviceType* type = type_of_log(types, path, *first)) return inspect_device_log(path, *type);
  if (const std::string packed = how_to_unpack(head); !packed.empty())
    return {nullptr, Error{ErrorCode::Unsupported, path + " " + packed}};
  if (ends_with(path, ".bin"))
    if (Inspection cloud = inspect_cloud(path, "rows of float32"); cloud.found) return cloud;
  std::string logs;
  for (const drivers::DeviceType* type : types)
    if (const drivers::DeviceFiles::Log& log = type->files.log; log.format)
      logs += fmt::format("{} ({}), ", log.format, log.ending);
  return {nullptr,
          Error{ErrorCode::Unsupported,
                fmt::format(
                    "{}: none of the formats that are known: MCAP, .bag and .db3 of ROS, LAS, pcap, "
                    "pcapng, PCD, PLY, E57, PTX, PTS, text with x y z, SMRMSG, clouds of KITTI and nuScenes (.bin) and "
                    "of NumPy (.npy), {}CAN logs (.asc, .blf, "
                    ".trc, candump -L, tcpdump -i can0, SavvyCAN, python-can, BUSMASTER), DBC, YAML rig or scenario",
                    path, logs)}};
}

}  // namespace hueline::apps
