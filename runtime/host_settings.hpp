#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/result.hpp"

namespace hueline::runtime {

/// The least net.core.rmem_max for the sockets of cameras and scanners, bytes: a quarter of a second of a camera at
/// 30 MB/s.
inline constexpr std::int64_t kWantedReceiveBuffer = 8'000'000;
/// Returns whether the kernel's clock source is coarse and slow to read.
bool is_slow_clock_source(const std::string& name);

/// A setting of the computer that disturbs a capture, and how it is set.
struct HostSetting {
  std::string name;            ///< what people call it: "net.core.rmem_max"
  std::string found;           ///< its value now
  std::string why;             ///< what it does to a capture
  std::string action;          ///< what to do; if there is a `file`, what makes the setting last beyond a restart
  std::filesystem::path file;  ///< the file of /proc or /sys that sets it; empty: only a person can
  std::string value;           ///< what is to be written there
};

/// Returns what is not set on the computer whose file system is at `root` ("/"; a made tree in tests), for any rig, and
/// for the network cards and devices that `rig` uses if there is one. It changes nothing and reads regular files alone.
/// What is not there (a computer without frequency scaling, without USB) is not missed.
std::vector<HostSetting> find_unset(const std::filesystem::path& root, const config::Rig* rig);

/// Writes the value of a setting. Errors: Invalid if it has no file, Io if the kernel refuses.
Status set(const HostSetting& setting);

}  // namespace hueline::runtime
