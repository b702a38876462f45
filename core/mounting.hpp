#pragma once

#include <optional>
#include <vector>

#include "core/calibration_record.hpp"
#include "core/frames.hpp"
#include "core/keys.hpp"

namespace hueline {

/// A rigid transform as files write it: `position_m: [x, y, z]` and one of
///   rotation_deg: [a, b, c]        R = Rz(c) Ry(b) Rx(a): about the fixed axes x, then y, then z
///   rotation_matrix: [9 numbers]   rows, orthonormal within 1e-6
///   quaternion_wxyz: [w, x, y, z]  normalised on reading
/// and, if it was calibrated, `calibration`: the record of that, which is checked and then left alone.
struct Mounting {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::vector<double> rotation_deg, rotation_matrix, quaternion_wxyz;  ///< as the file has them; all empty: no rotation
  std::optional<CalibrationRecord> calibration;

  void visit(Keys& keys);
  KeyError validate() const;

  Eigen::Quaterniond rotation() const;
  template <class To, class From>
  Transform<To, From> transform() const {
    return {rotation(), position_m};
  }
};

/// Declares the key of a mapping that holds T_to_from, named as in code: T_body_scanner, T_body_head, T_head_lens.
template <class To, class From>
void visit_transform(Keys& keys, const Key& key, Transform<To, From>& transform) {
  Mounting mounting;
  if (keys.section(key, mounting)) transform = mounting.transform<To, From>();
}

}  // namespace hueline
