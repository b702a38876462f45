#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/sample_bits.hpp"
#include "core/time.hpp"

/// The topics whose images become cameras.
namespace hueline::apps {

/// The images of one topic.
struct CameraTopic {
  std::string format{}, frame{};        ///< of the first image that can be read
  std::uint32_t width = 0, height = 0;  ///< px; 0: none can be read
  bool is_grey = false, is_compressed = false;
  int orientation = 1;          ///< how EXIF data show the first image (core/exif_orientation.hpp)
  std::uint64_t images = 0;     ///< messages
  std::uint64_t unstamped = 0;  ///< those of them whose driver left the stamp 0
  /// The shortest time from a stamp to the recorder's time; negative if stamps are ahead of it.
  std::optional<nanoseconds> delay{};
  unsigned used_bits = 0;  ///< of samples with 16 bits, of all images; 0: the samples have 8
  /// How many bits the samples have to be raised: those of a camera with 10, 12 or 14 bits are stored in 16.
  unsigned raised_bits() const { return used_bits == 0 ? 0 : empty_bits(used_bits); }
  std::string why{};      ///< why its images cannot be read
  bool has_lens = false;  ///< the recording says its lens, and the model is read
};

/// The topics that become cameras, and the others.
struct CameraChoice {
  std::vector<std::string> topics;
  std::map<std::string, std::string> not_used;  ///< why the other topics are not used, by their names
};

/// Chooses among `found`, by their names. Images of one frame are of one camera, so one topic of them is taken: colours
/// before grey, then one whose lens is known, one that has at least half of the images, the most pixels, images as the
/// camera gave them before rectified ones, whole before compressed ones, and the first by name. Where there are
/// colours, grey cameras are not taken. `wanted` names topics that are taken instead of all others. Errors: Invalid if
/// `wanted` names a topic that cannot be used.
Result<CameraChoice> choose_cameras(const std::map<std::string, CameraTopic>& found,
                                    const std::vector<std::string>& wanted);

}  // namespace hueline::apps
