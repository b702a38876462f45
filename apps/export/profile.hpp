#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/capture/trajectory_options.hpp"
#include "apps/command_line.hpp"

namespace hueline::apps {

/// What every profile of `hueline export` is told.
struct ExportWords {
  std::string drive;  ///< a drive's folder, a recording or a cloud
  std::string rig;    ///< a rig file to use instead of the recorded one; empty: none
  std::string out;
  std::string split;  ///< how a cloud is cut; empty: it is not
  int threads = 2;
  TrajectoryOptions trajectory;  ///< calculated after the drive, to be used in place of the POS's solutions
};

/// A kind of file, or of a folder of files, that `hueline export` writes. A new one is a class in a file of its own and
/// a line in export_profiles().
class ExportProfile {
 public:
  virtual ~ExportProfile() = default;
  virtual const char* word() const = 0;  ///< behind --profile
  virtual const char* help() const = 0;  ///< its line of the help
  virtual bool writes_folder(const ExportWords& words) const {
    (void)words;
    return false;
  }
  /// How the name of its file ends, ".laz"; empty: it has several endings and tells a wrong one itself, or it writes a
  /// folder.
  virtual std::string ending() const { return {}; }
  /// Returns whether a file of this name, in small letters, is what the profile writes.
  virtual bool is_name(const std::string& name) const { return name.ends_with(ending()); }
  virtual bool splits() const { return false; }  ///< ExportWords::split is of use
  /// Reads the drive's recording: ExportWords::rig and trajectory are of use.
  virtual bool reads_recording(const ExportWords& words) const {
    (void)words;
    return true;
  }
  /// Declares the options that only this profile has. Their help begins with the profile's word.
  virtual void declare(Command& command) { (void)command; }
  /// Writes. Returns the exit status (apps/exit_code.hpp).
  virtual int run(const ExportWords& words) = 0;
};

std::unique_ptr<ExportProfile> make_laz_profile();
std::unique_ptr<ExportProfile> make_copc_profile();
std::unique_ptr<ExportProfile> make_ply_profile();
std::unique_ptr<ExportProfile> make_e57_profile();
std::unique_ptr<ExportProfile> make_trajectory_profile();
std::unique_ptr<ExportProfile> make_images_profile();

}  // namespace hueline::apps
