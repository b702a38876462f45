#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "apps/colour/shot_calibration.hpp"

/// What the forms of other programs' calibrations (published_calibration.hpp) have in common. All functions throw
/// config::ConfigError, whose message names the file.
namespace hueline::apps {

using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
/// The rows of a matrix, one after another.
using Numbers = std::vector<double>;
constexpr int kDeepest = 3;  ///< lists in lists, of a matrix

/// Checks that this is a pose, and returns it. `where` is its place, for the message.
Transform<Lens, Scanner> pose_of(const Matrix34& T, const std::string& where);
/// The same of 3 or 4 rows of 4 numbers.
Transform<Lens, Scanner> pose_of(const Numbers& T, const std::string& where);
/// The same of the rows of a rotation and of a translation, which stand under these keys.
Transform<Lens, Scanner> pose_of(const Numbers& R, const Numbers& t, const std::string& file, const char* R_key,
                                 const char* t_key);
/// Returns the pose of the laser in the lens's frame from that of the lens in the laser's frame.
Transform<Lens, Scanner> turned_round(const Transform<Lens, Scanner>& T_scanner_lens);
/// Returns ShotCalibration::pose_note of a pose that was turned round because of the file's name.
std::string turned_by_name(const std::string& file);

/// What a file says of a lens.
struct PublishedLens {
  Numbers K, distortion;
  std::string model;   ///< in the words of ROS, Kalibr or OpenCV; empty: k1 k2 p1 p2 [k3]
  Numbers shape = {};  ///< of the models omni (xi), ds (xi, alpha) and eucm (alpha, beta)
  std::uint32_t width = 0, height = 0;
};
/// Checks that this is a lens whose model is read, and takes it. `key` is that of the camera matrix.
void take_lens(const PublishedLens& lens, const std::string& file, const std::string& key, ShotCalibration& out);
/// Checks that a lens model is read.
void check_model(const std::string& file, const std::string& model);
/// Makes rows of a camera matrix from fx fy cx cy.
Numbers camera_matrix(const Numbers& v);

/// Keys under which others name the lens model, and those that may also name a product or a projection.
constexpr std::initializer_list<const char*> kModelKeys = {"distortion_model", "DistModel"};
constexpr std::initializer_list<const char*> kLooseModelKeys = {"camera_model", "model", "projection_type"};
/// Keys of the distortion, and those of the size of the image.
constexpr std::initializer_list<const char*> kDistortionKeys = {
    "distortion_coefficients", "distortion_coeffs", "DistCoeff", "dist_coeffs", "dist_coeff", "D", "d"};
constexpr std::initializer_list<const char*> kWidthKeys = {"image_width", "width"};
constexpr std::initializer_list<const char*> kHeightKeys = {"image_height", "height"};

std::string lower_case(std::string word);
/// Returns the lens model that a word under one of kLooseModelKeys names, in the words of take_lens(); empty if it
/// names none: a product, or no more than a projection through one point.
std::string loose_model(const std::string& word);
/// Checks that a lens's distortion, which stands under `key`, was read: without numbers it must be an empty list.
void check_distortion(const std::string& file, const std::string& key, const Numbers& numbers, bool is_empty);

}  // namespace hueline::apps
