#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sync/host_clock_model.hpp"
#include "tests/sync/simulated_time.hpp"

namespace hueline::test {

using sync::GpsStamp;
using sync::HostClockModel;

/// What a model stated during a drive, compared with the truth.
struct Course {
  struct Sample {
    GpsTime truth;
    std::optional<GpsStamp> stamp;
    SyncState state;
    bool can_stamp;
    double error_us() const { return static_cast<double>((stamp->time - truth).count()) * 1e-3; }
    double normalised() const {
      return static_cast<double>((stamp->time - truth).count()) / static_cast<double>(stamp->sigma.count());
    }
  };
  std::vector<Sample> samples;  // every 0.1 s, at instants between the edges
  std::vector<Fault> faults;
  HostClockModel model;

  Course(Drive& drive, HostClockModel::Config config);
  std::uint64_t count(FaultKind kind) const {
    std::uint64_t n = 0;
    for (const Fault& f : faults)
      if (f.kind == kind) n += f.count;
    return n;
  }
  std::string details(FaultKind kind) const {
    std::string all;
    for (const Fault& f : faults)
      if (f.kind == kind) all += f.detail + "\n";
    return all;
  }
  SyncState at(GpsTime t) const {
    for (const Sample& s : samples)
      if (s.truth >= t) return s.state;
    return samples.back().state;
  }
  /// Every time that is offered for use must have the right second, without exception.
  void expect_never_wrong_by(nanoseconds limit) const {
    for (const Sample& s : samples)
      if (s.can_stamp && s.stamp) {
        ASSERT_LT(std::abs((s.stamp->time - s.truth).count()), limit.count())
            << to_seconds(s.truth - samples.front().truth) << " s in, state " << name(s.state);
      }
  }
};

inline HostClockModel::Config clock_config() {
  HostClockModel::Config c;
  c.pps = kPps;
  c.label.trusted = kPos;
  c.filter.edge_bias_us = 0;  // the simulated edges have no constant latency unless a test gives them one
  return c;
}

}  // namespace hueline::test
