#pragma once

#include <optional>
#include <vector>

#include "core/calibration_record.hpp"
#include "core/frames.hpp"
#include "core/keys.hpp"

namespace hueline {

/// A rigid transform as files write it: `position_m: [x, y, z]` and exactly one of the following.
///
///   key               value         meaning
///   rotation_deg      [a, b, c]     R = Rz(c) Ry(b) Rx(a): turns about the fixed axes x, then y, then z
///   rotation_matrix   [9 numbers]   rows of the matrix, orthonormal within 1e-6
///   quaternion_wxyz   [w, x, y, z]  length 1 within 0.001; normalised when it is read
///
/// A calibrated mounting also has `calibration`, the record of that calibration; it is checked, but not used.
struct Mounting {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::vector<double> rotation_deg, rotation_matrix, quaternion_wxyz;  ///< as in the file; all empty: no rotation
  std::optional<CalibrationRecord> calibration;

  void visit(Keys& keys);
  KeyError validate() const;

  Eigen::Quaterniond rotation() const;
  template <class To, class From>
  Transform<To, From> transform() const {
    return {rotation(), position_m};
  }
};

/// Declares the key of a mapping that holds T_to_from. The key has the name that the code uses: T_body_scanner,
/// T_body_head, T_head_lens.
template <class To, class From>
void visit_transform(Keys& keys, const Key& key, Transform<To, From>& transform) {
  Mounting mounting;
  if (keys.section(key, mounting)) transform = mounting.transform<To, From>();
}

}  // namespace hueline
