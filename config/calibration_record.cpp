#include "config/calibration_record.hpp"

namespace hueline::config {

CalibrationRecord read_calibration_record(Section section) {
  constexpr double kHuge = 1e12;
  CalibrationRecord out;
  out.method = section.text("method");
  out.date = section.text("date");
  out.data = section.texts("data");
  if (section.has("residual_rms")) out.residual_rms = section.number("residual_rms", {0, kHuge});
  if (section.has("residual_unit")) out.residual_unit = section.text("residual_unit");
  out.parameters = section.texts("parameters");
  out.sigma = section.numbers("sigma", {0, kHuge});
  if (section.has("covariance")) out.covariance = section.numbers("covariance", {-kHuge, kHuge});
  if (const std::string wrong = out.validate(); !wrong.empty()) section.refuse("method", wrong);
  section.finish();
  return out;
}

void check_calibration_record(Section& parent) {
  if (parent.has("calibration")) read_calibration_record(parent.section("calibration"));
}

}  // namespace hueline::config
