#include "runtime/host_settings.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "runtime/sensor_values.hpp"

namespace hueline::runtime {
namespace {

namespace fs = std::filesystem;

/// Returns the first line of a small file of /proc or /sys; empty if it cannot be read.
std::string line_of(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::optional<std::int64_t> number_of(const fs::path& file) {
  std::istringstream in(line_of(file));
  std::int64_t value = 0;
  if (in >> value) return value;
  return {};
}

std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code failed;
  for (fs::directory_iterator i(folder, failed), end; !failed && i != end; i.increment(failed))
    out.push_back(i->path());
  std::sort(out.begin(), out.end());
  return out;
}

void find_buffers(const fs::path& root, std::vector<HostSetting>& out) {
  const fs::path sockets = root / "proc/sys/net/core/rmem_max";
  if (const auto bytes = number_of(sockets); bytes && *bytes < kWantedReceiveBuffer)
    out.push_back({"net.core.rmem_max", std::to_string(*bytes),
                   "the sockets of cameras and scanners lose packets when the computer is busy for a moment",
                   "/usr/lib/sysctl.d/60-hueline.conf of the package hueline-capture", sockets, "33554432"});
  // 0 means no limit.
  constexpr std::int64_t kWantedUsb_MB = 256;
  const fs::path usb = root / "sys/module/usbcore/parameters/usbfs_memory_mb";
  if (const auto megabytes = number_of(usb); megabytes && *megabytes != 0 && *megabytes < kWantedUsb_MB)
    out.push_back({"usbcore.usbfs_memory_mb", std::to_string(*megabytes),
                   "all USB cameras together have so little memory for transfers that images are lost",
                   "/usr/lib/tmpfiles.d/hueline.conf of the package hueline-capture", usb, "1000"});
}

void find_clock_source(const fs::path& root, std::vector<HostSetting>& out) {
  const fs::path folder = root / "sys/devices/system/clocksource/clocksource0";
  const std::string current = line_of(folder / "current_clocksource");
  if (!is_slow_clock_source(current)) return;
  std::istringstream available(line_of(folder / "available_clocksource"));
  HostSetting setting{"clock source",
                      current,
                      "it is coarse, and slow to read: stamps of packets are worse",
                      "find in the kernel's log why tsc was given up (dmesg | grep -i tsc)",
                      {},
                      {}};
  for (std::string word; available >> word;)
    if (word == "tsc" || word == "arch_sys_counter") {
      setting.file = folder / "current_clocksource";
      setting.value = word;
      setting.action = "clocksource=" + word + " on the kernel's command line";
    }
  out.push_back(std::move(setting));
}

void find_governors(const fs::path& root, std::vector<HostSetting>& out) {
  for (const fs::path& cpu : entries(root / "sys/devices/system/cpu")) {
    const fs::path file = cpu / "cpufreq/scaling_governor";
    const std::string governor = line_of(file);
    if (governor.empty() || governor == "performance") continue;
    out.push_back({"governor of " + cpu.filename().string(), governor,
                   "the processor is slow when a burst begins, and packets wait",
                   "a line in /etc/tmpfiles.d: w /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor - - - - "
                   "performance",
                   file, "performance"});
  }
}

/// Returns the words of the lines of chrony's configuration that begin with `directive`. The last one is in force.
std::vector<std::string> chrony_words(const fs::path& root, const std::string& directive) {
  std::vector<std::string> words;
  auto files = entries(root / "etc/chrony/conf.d");
  files.insert(files.begin(), root / "etc/chrony/chrony.conf");
  for (const fs::path& file : files) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
      std::istringstream text(line);
      std::string first;
      if (!(text >> first) || first != directive) continue;
      words.clear();
      for (std::string word; text >> word;) words.push_back(word);
    }
  }
  return words;
}

void find_clock_steps(const fs::path& root, std::vector<HostSetting>& out) {
  constexpr const char* kWhy =
      "a step of the computer's clock during a drive disturbs the pulse per second, which the kernel stamps by it";
  constexpr const char* kAction =
      "take /usr/share/doc/hueline-capture/examples/chrony.conf as /etc/chrony/conf.d/hueline.conf";
  const auto step = chrony_words(root, "makestep");
  if (step.size() == 2 && step[1].starts_with('-'))
    out.push_back({"chrony", "makestep " + step[0] + " " + step[1], kWhy, kAction, {}, {}});
  std::error_code unknown;
  if (fs::exists(root / "run/systemd/timesync/synchronized", unknown))
    out.push_back(
        {"systemd-timesyncd", "it sets the clock", kWhy, fmt::format("install chrony, and {}", kAction), {}, {}});
}

/// Which card the camera is at is not known before it answers, so a person sets this.
void find_small_packets(const fs::path& root, std::vector<HostSetting>& out) {
  constexpr std::int64_t kGigabit = 1000, kLargePacket = 9000;
  for (const fs::path& interface : entries(root / "sys/class/net")) {
    // A real card has a device; one of a gigabit and more can have a camera.
    std::error_code unknown;
    if (!fs::exists(interface / "device", unknown)) continue;
    const auto speed_Mb = number_of(interface / "speed"), mtu = number_of(interface / "mtu");
    if (!speed_Mb || *speed_Mb < kGigabit || !mtu || *mtu >= kLargePacket) continue;
    const std::string name = interface.filename().string();
    out.push_back({"MTU of " + name,
                   std::to_string(*mtu),
                   "a GigE camera at this interface sends six times as many packets, and each costs time",
                   fmt::format("if the camera is there: ip link set {} mtu 9000, and to make it last "
                               "/usr/share/doc/hueline-capture/examples/camera.network",
                               name),
                   {},
                   {}});
  }
}

void find_rights(const fs::path& root, const config::Rig& rig, std::vector<HostSetting>& out) {
  for (const auto& sensor : rig.sensors) {
    const auto values = values_of(sensor);
    for (const char* key : {"device", "serial.device"}) {
      const auto found = values.find(key);
      if (found == values.end() || !found->second.starts_with('/')) continue;
      const fs::path device = root / fs::path(found->second).relative_path();
      if (::access(device.c_str(), R_OK) == 0) continue;
      const bool is_there = errno == EACCES;
      out.push_back({sensor.name,
                     found->second + ": " + std::strerror(errno),
                     "the sensor cannot be read",
                     is_there ? "add the user to the device's group: ls -l " + found->second
                              : "plug the device in, or correct the rig",
                     {},
                     {}});
    }
  }
}

}  // namespace

bool is_slow_clock_source(const std::string& name) {
  static const std::set<std::string> kSlow{"hpet", "acpi_pm", "jiffies", "refined-jiffies", "pit"};
  return kSlow.contains(name);
}

std::vector<HostSetting> find_unset(const fs::path& root, const config::Rig* rig) {
  std::vector<HostSetting> out;
  find_buffers(root, out);
  find_clock_source(root, out);
  find_governors(root, out);
  find_clock_steps(root, out);
  if (rig == nullptr) return out;
  if (std::ranges::any_of(rig->sensors, [](const auto& sensor) { return values_of(sensor).contains("packet_size"); }))
    find_small_packets(root, out);
  find_rights(root, *rig, out);
  return out;
}

Status set(const HostSetting& setting) {
  if (setting.file.empty()) return Error{ErrorCode::Invalid, setting.name + " is for a person to set"};
  const int fd = ::open(setting.file.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  const bool done =
      fd >= 0 && ::write(fd, setting.value.data(), setting.value.size()) == static_cast<ssize_t>(setting.value.size());
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (done) return {};
  return Error{ErrorCode::Io, fmt::format("{}: {}", setting.file.string(), std::strerror(error))};
}

}  // namespace hueline::runtime
