#include "core/calibration_record.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hueline {
namespace {

/// In double quotes, with what YAML would take for something else written out.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

std::string number(double value) { return fmt::format("{:.9g}", value); }
std::string plain(const std::string& text) { return text; }

template <class T, class F>
std::string list(const std::vector<T>& values, F&& write) {
  std::string out = "[";
  for (std::size_t i = 0; i < values.size(); ++i) out += (i ? ", " : "") + write(values[i]);
  return out + "]";
}

bool is_date(const std::string& text) {
  if (text.size() != 10) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_dash = i == 4 || i == 7;
    if (is_dash ? text[i] != '-' : text[i] < '0' || text[i] > '9') return false;
  }
  return true;
}

}  // namespace

std::string CalibrationRecord::validate() const {
  if (method.empty()) return "method is empty; allowed: the name of the tool";
  if (!is_date(date)) return fmt::format("date is '{}'; allowed: YYYY-MM-DD", date);
  if (residual_rms && !(*residual_rms >= 0 && std::isfinite(*residual_rms))) return fmt::format("residual_rms is {}; allowed: 0 or more", *residual_rms);
  if (residual_rms.has_value() == residual_unit.empty()) return "residual_rms and residual_unit go together; allowed: both or none";
  const std::size_t n = parameters.size();
  if (sigma.size() != n) return fmt::format("sigma has {} numbers; allowed: one for each of the {} parameters", sigma.size(), n);
  for (const double s : sigma)
    if (!(s >= 0 && std::isfinite(s))) return fmt::format("sigma has {}; allowed: 0 or more", s);
  if (!covariance.empty() && covariance.size() != n * (n + 1) / 2)
    return fmt::format("covariance has {} numbers; allowed: {} (the upper triangle of {} parameters by rows) or none", covariance.size(),
                       n * (n + 1) / 2, n);
  return {};
}

std::string CalibrationRecord::yaml(int indent) const {
  const std::string in(static_cast<std::size_t>(indent), ' '), deep = in + "  ";
  std::string out = in + "calibration:\n";
  out += deep + "method: " + method + "\n";
  out += deep + "date: \"" + date + "\"\n";
  out += deep + "data: " + list(data, quoted) + "\n";
  if (residual_rms) out += deep + "residual_rms: " + number(*residual_rms) + "\n" + deep + "residual_unit: " + residual_unit + "\n";
  out += deep + "parameters: " + list(parameters, plain) + "\n";
  out += deep + "sigma: " + list(sigma, number) + "\n";
  if (!covariance.empty()) out += deep + "covariance: " + list(covariance, number) + "\n";
  return out;
}

}  // namespace hueline
