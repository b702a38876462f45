#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/decode/decode_bag.hpp"
#include "apps/decode/decode_capture.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "core/calendar.hpp"

namespace hueline::apps {
namespace {

struct DecodeCommandOptions {
  std::string capture, out, near;
  std::vector<std::string> calibration;
};

/// Reads "2016-01-21T08:18:02Z", the seconds and the Z may be missing.
std::optional<GpsTime> parse_utc(const std::string& text) {
  UtcTime utc;
  char rest[8] = "";
  const int found = std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d%7s", &utc.year, &utc.month, &utc.day, &utc.hour,
                                &utc.minute, rest);
  if (found < 5) return {};
  const std::string tail = rest;
  if (!tail.empty() && tail != "Z" && std::sscanf(rest, ":%2d", &utc.second) != 1) return {};
  return from_utc(utc);
}

std::string text_of(const DecodedScanner& scanner) {
  std::string out = fmt::format("{} at {}: {} points", scanner.name, scanner.address, scanner.points);
  if (scanner.points_by_return.size() > 1)
    for (const auto& [number, count] : scanner.points_by_return) out += fmt::format(", return {}: {}", number, count);
  if (scanner.points > 0) out += "\n  " + scanner.cloud.string() + "\n  time: " + scanner.clock;
  if (scanner.begin) out += fmt::format("\n  from {} to {}", iso_utc(*scanner.begin), iso_utc(*scanner.end));
  if (!scanner.note.empty()) out += "\n  " + scanner.note;
  for (const auto& [kind, count] : scanner.faults)
    out += fmt::format("\n  {} {}: {}", count, kind, scanner.fault_details.at(kind));
  return out + "\n";
}

/// Says what was decoded, and returns the exit status.
int tell(const DecodedCapture& decoded, const DecodeOptions& options) {
  std::uint64_t points = 0;
  for (const DecodedScanner& scanner : decoded.scanners) {
    std::fputs(text_of(scanner).c_str(), stdout);
    points += scanner.points;
  }
  for (const std::string& one : decoded.not_supported) log_error("not supported: " + one);
  if (!decoded.trouble.ok()) log_error(decoded.trouble.error().message);
  if (!decoded.written.ok()) {
    log_error(decoded.written.error().message);
    return kOutputRefused;
  }
  bool is_whole = decoded.trouble.ok() && decoded.not_supported.empty();
  for (const DecodedScanner& scanner : decoded.scanners)
    if (scanner.points == 0 && points > 0) {
      log_error("{}: the {} at {} gave no point", options.capture, scanner.name, scanner.address);
      is_whole = false;
    }
  for (const std::string& one : options.descriptions)
    if (!decoded.used_descriptions.contains(one)) {
      const auto refused = decoded.refused_descriptions.find(one);
      log_error("--calibration {}: not used: {}", one,
                refused != decoded.refused_descriptions.end()
                    ? refused->second
                    : "it describes none of the scanners here (other beams or packets, or the number of another "
                      "scanner)");
      is_whole = false;
    }
  if (points == 0) {
    log_error(options.capture + ": no scanner in it gave a point");
    return is_whole ? kNothingCame : kInputUnreadable;
  }
  return is_whole ? kDone : kInputUnreadable;
}

/// Decodes a recording of ROS.
int decode_recording(const DecodeOptions& options) {
  const auto bag = decode_bag(options);
  if (!bag.ok()) {
    log_error(bag.error().message);
    return bag.error().code == ErrorCode::Io ? kOutputRefused : kInputUnreadable;
  }
  std::map<std::string, std::string> used = bag->unused;
  for (auto& [topic, why] : used) why = "not used: " + why;
  for (const DecodedScanner& scanner : bag->decoded.scanners)
    used[scanner.address] = fmt::format("{}: {} points", scanner.name, scanner.points);
  for (const rosbag::TopicCount& one : bag->read.topics)
    if (one.file.extension() == ".json") used[one.topic.name] = "metadata of an Ouster";
  std::fputs(topic_table(bag->read.topics, used).c_str(), stdout);
  if (bag->read.damages > 0)
    log_error("{} damaged parts were skipped; the first: {}", bag->read.damages, bag->read.first_damage);
  if (!bag->read.end.ok()) log_error(bag->read.end.error().message);
  const int status = tell(bag->decoded, options);
  const bool is_whole = bag->read.damages == 0 && bag->read.end.ok();
  return status == kDone && !is_whole ? kInputUnreadable : status;
}

int decode(const DecodeCommandOptions& options) {
  const auto ending = std::filesystem::path(options.out).extension();
  if (ending != ".las" && ending != ".pcd") {
    log_error(options.out + ": the name of the cloud ends with .las or .pcd, which chooses the format");
    return kWrongUse;
  }
  DecodeOptions what;
  what.capture = options.capture;
  what.out = options.out;
  what.descriptions = options.calibration;
  what.trusts_arrivals = options.near == "arrivals";
  if (!options.near.empty() && !what.trusts_arrivals) {
    what.near = parse_utc(options.near);
    if (!what.near) {
      log_error("--near " + options.near + ": give a UTC time such as 2016-01-21T08:18, or the word arrivals");
      return kWrongUse;
    }
  }
  if (rosbag::is_bag(what.capture)) return decode_recording(what);
  const auto decoded = decode_capture(what);
  if (!decoded.ok()) {
    const bool is_other_recording =
        decoded.error().code == ErrorCode::Unsupported && rosbag::open_bag(what.capture).ok();
    log_error(is_other_recording ? what.capture +
                                       ": a recording without messages of ROS that can be read; hueline inspect lists "
                                       "what is in it"
                                 : decoded.error().message);
    return kInputUnreadable;
  }
  return tell(*decoded, what);
}

}  // namespace

void add_decode(Command& all) {
  auto options = std::make_shared<DecodeCommandOptions>();
  Command command = all.command(
      "decode",
      "make clouds of the laser scanners in a capture file or a recording of ROS, in each scanner's own frame");
  command.required("FILE", options->capture,
                   "pcap or pcapng file with the datagrams of known scanners, or a recording of ROS that holds them or "
                   "point clouds: MCAP, .db3 or a folder of them, .bag");
  command.required(
      "--out", options->out,
      "cloud to write: .las or .pcd; with several scanners, each gets its address or its topic in the name");
  command.option("--calibration", options->calibration,
                 "files that describe a scanner of the capture, such as its angles; those that lie beside the capture "
                 "are found");
  command.option("--near", options->near,
                 "for a scanner that counts within the hour and names no hour: a UTC time within half an hour of the "
                 "first datagram, or the word arrivals to believe the capture file's own times");
  command.reads(options->capture).reads(options->calibration).writes(options->out);
  command.footer(
      "Example: hueline decode street.pcap --out street.las\n"
      "Exit status: 0; 3 if the capture is damaged, or has scanners that are not known; 5 if it has no point.\n"
      "More: docs/operating.md");
  command.runs([options] { return decode(*options); });
}

}  // namespace hueline::apps
