#include "core/calibration_record.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hueline {
namespace {

/// Puts a text in double quotes and escapes what YAML would otherwise interpret.
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

void CalibrationRecord::visit(Keys& keys) {
  static const TextForm day{"YYYY-MM-DD, in quotes", is_date, R"(^\d{4}-\d{2}-\d{2}$)"};
  constexpr double kHuge = 1e12;
  keys.text(required("method", "", "The tool that found the value."), method);
  keys.text(required("date", "", "The day of the calibration."), date, day);
  keys.texts(required("data", "", "The files, recordings and counts that the calibration used."), data);
  keys.number({"residual_rms", "",
               "The root mean square of the residuals of the adjustment. A method that has none, such as an alignment "
               "without targets, leaves the key out.",
               "none"},
              residual_rms, {0, kHuge});
  keys.text({"residual_unit", "", "The unit of `residual_rms`, such as px or m. The two keys belong together.", "none"},
            residual_unit);
  keys.texts(required("parameters", "", "The names of the parameters, with their units."), parameters);
  keys.numbers(required("sigma", "", "One standard deviation of each parameter."), sigma, {0, kHuge});
  keys.numbers({"covariance", "",
                "The upper triangle of the covariance matrix by rows: n (n + 1) / 2 numbers for n parameters.", "none"},
               covariance, {-kHuge, kHuge});
}

KeyError CalibrationRecord::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (residual_rms.has_value() == residual_unit.empty())
    return residual_rms ? KeyError{"residual_unit", "is missing beside residual_rms; allowed: both or none"}
                        : KeyError{"residual_unit", "stands without residual_rms; allowed: both or none"};
  const std::size_t n = parameters.size();
  if (sigma.size() != n)
    return not_allowed("sigma", fmt::format("a list of {}", sigma.size()),
                       fmt::format("one number for each of the {} parameters", n));
  if (!covariance.empty() && covariance.size() != n * (n + 1) / 2)
    return not_allowed(
        "covariance", fmt::format("a list of {}", covariance.size()),
        fmt::format("{} numbers (the upper triangle of {} parameters by rows) or none", n * (n + 1) / 2, n));
  return {};
}

std::string CalibrationRecord::yaml(int indent) const {
  const std::string in(static_cast<std::size_t>(indent), ' '), deep = in + "  ";
  std::string out = in + "calibration:\n";
  out += deep + "method: " + method + "\n";
  out += deep + "date: \"" + date + "\"\n";
  out += deep + "data: " + list(data, quoted) + "\n";
  if (residual_rms)
    out += deep + "residual_rms: " + number(*residual_rms) + "\n" + deep + "residual_unit: " + residual_unit + "\n";
  out += deep + "parameters: " + list(parameters, plain) + "\n";
  out += deep + "sigma: " + list(sigma, number) + "\n";
  if (!covariance.empty()) out += deep + "covariance: " + list(covariance, number) + "\n";
  return out;
}

}  // namespace hueline
