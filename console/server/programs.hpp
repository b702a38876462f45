#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "console/server/places.hpp"
#include "core/child.hpp"
#include "core/result.hpp"

namespace hueline::console {

/// The programs that the console starts: their words, and the folder `.console` of the drives, in which they work and
/// leave what they print. Errors of the functions that start one: Io. Thread safety: none.
class Programs {
 public:
  /// `places` must outlive this.
  explicit Programs(const Places& places) : places_(places) {}

  /// Checks whether a rig is ready for a drive; checked() has what was found.
  Result<Child> check(const std::string& rig_file, double seconds) const;
  /// Renders a scenario, and writes the rig of its emulated devices: rig_of().
  Result<Child> render(const std::string& scenario) const;
  /// Emulates the devices of a scenario that was rendered.
  Result<Child> emulate(const std::string& scenario) const;
  /// Captures a drive. `is_emulated`: it ends when the devices fall silent.
  Result<Child> capture(const std::string& rig_file, const std::string& drive, bool is_emulated) const;
  /// Replays a drive into the folder of replays, in which one replay is kept: it can be made again.
  Result<Child> replay(const std::filesystem::path& recording, const std::string& drive, double speed,
                       double from_s) const;

  std::filesystem::path replays() const { return places_.drives / ".replay"; }
  std::string rig_of(const std::string& scenario) const { return work("sim-" + scenario + ".yaml"); }
  /// Returns the result of the check as the program wrote it; null if it wrote none.
  nlohmann::ordered_json checked() const { return read_json(work("check.json")); }

  // The last lines that they printed.
  std::string check_said() const { return last_lines(work("check.log"), kFewLines); }
  std::string render_said() const { return last_lines(work("simulate.log"), kLines); }
  std::string drive_said() const { return last_lines(work("capture.log"), kLines); }  ///< of a capture or a replay

 private:
  static constexpr std::size_t kFewLines = 2000, kLines = 4000;  // bytes
  /// Returns the path of a file in the folder of the programs, which is made.
  std::filesystem::path work(const std::string& file) const;
  Result<Child> simulate(const std::string& scenario, const std::vector<std::string>& how, const char* log) const;

  const Places& places_;
};

}  // namespace hueline::console
