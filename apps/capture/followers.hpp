#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/signals.hpp"
#include "config/rig.hpp"
#include "core/child.hpp"
#include "runtime/disk_reserve.hpp"

namespace hueline::apps {

/// The programs that make products of a capture's recording while it grows, as the rig's keys `panoramas` and `images`
/// say. Each reads the recording for itself, at a low priority, so that none can hold up the capture: one that is
/// slow is late, and one that fails is told. What each says is in a file of its name beside the recording, such as
/// `panoramas.log`. Thread safety: none; one thread calls all functions.
class Followers {
 public:
  /// Starts them; the recording in the folder `drive` exists. One that cannot be started is told.
  Followers(const config::Rig& rig, const std::filesystem::path& drive);

  /// Tells of programs that have ended before the drive, and asks all to end when the disk's last space is reached.
  /// Call it from time to time.
  void look(const runtime::DiskReserve& reserve);
  /// Waits until all have come to the end of the recording, which is closed and whose folder nobody holds any more, and
  /// tells what they made. After one more Ctrl-C they are asked to end, and not waited for. Returns the exit status:
  /// kOutputRefused if a product is not whole, kStopped if one was not waited for.
  int finish(const StopSignals& signals);

 private:
  struct Follower {
    std::string product;  // a key of the rig, and the name of the folder
    std::filesystem::path said;
    std::string again;  // the command that makes the product afterwards
    Child child;
    bool is_whole = false, is_over = false;
  };
  void start(const std::string& product, const std::vector<std::string>& command,
             const std::vector<std::string>& options);
  void take_end(Follower& one, bool is_drive_over);

  std::filesystem::path drive_;
  std::vector<Follower> followers_;
  bool has_room_ = true;
};

}  // namespace hueline::apps
