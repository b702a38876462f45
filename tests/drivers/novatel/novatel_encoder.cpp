#include "tests/drivers/novatel/novatel_encoder.hpp"

#include <fmt/format.h>

namespace hueline::test {
namespace {

std::string numbers(const auto& values) {
  std::string out;
  for (const double v : values) out += fmt::format(" {:a}", v);
  return out;
}

struct Describe {
  std::string operator()(const TimeLabel& m) const {
    return fmt::format("label {} {} {} {}", count_ns(m.second), m.utc_offset ? m.utc_offset->count() : -1, m.is_valid,
                       count_ns(m.received));
  }
  std::string operator()(const TimedArrival& m) const {
    return fmt::format("arrival {} {}", count_ns(m.time), count_ns(m.received));
  }
  std::string operator()(const InsSolution& m) const {
    return fmt::format("ins {} {:a} {:a} {:a}{} {:a} {:a} {:a} {} {}{}", count_ns(m.time), m.position.latitude,
                       m.position.longitude, m.position.ellipsoidal_height, numbers(m.velocity_enu), m.attitude.roll,
                       m.attitude.pitch, m.attitude.heading, m.is_good, m.status, m.sigma ? numbers(*m.sigma) : "");
  }
  std::string operator()(const InsUncertainty& m) const {
    return fmt::format("sigma {}{}", count_ns(m.time), numbers(m.sigma));
  }
  std::string operator()(const GnssFix& m) const {
    return fmt::format("fix {} {} {:a} {:a} {:a}{} {}", count_ns(m.time), name(m.type), m.position.latitude,
                       m.position.longitude, m.position.ellipsoidal_height, numbers(m.sigma_enu), m.satellites);
  }
  std::string operator()(const ImuSample& m) const {
    return fmt::format("imu {}{}{}", count_ns(m.time), numbers(m.specific_force_body), numbers(m.angular_rate_body));
  }
  std::string operator()(const EventMark& m) const {
    return fmt::format("mark {} {} {}", count_ns(m.time), m.input, m.is_valid);
  }
  std::string operator()(const Fault& m) const {
    return fmt::format("fault {} {} {}", name(m.kind), m.count, m.detail);
  }
  std::string operator()(const auto&) const { return "other"; }
};

}  // namespace

std::string described(const Measurement& measurement) { return std::visit(Describe{}, measurement); }

}  // namespace hueline::test
