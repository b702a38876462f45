#include "tests/sync/clock_course.hpp"

namespace hueline::test {

Course::Course(Drive& drive, HostClockModel::Config config) : model(config) {
  GpsTime next = drive.begin + ms(130);
  for (auto& [received, m] : drive.stream.sorted()) {
    while (next < drive.end && drive.clock.host(next) < received) {
      model.advance(drive.clock.host(next));
      samples.push_back({next, model.stamp(drive.clock.host(next)), model.state(), model.can_stamp()});
      next += ms(100);
    }
    if (auto* edge = std::get_if<PpsEdge>(&m)) model.add(*edge);
    if (auto* label = std::get_if<TimeLabel>(&m)) model.add(*label);
    if (auto* solution = std::get_if<InsSolution>(&m))
      model.add(TimedArrival{solution->sensor, solution->received, solution->time});
    model.drain(faults);
  }
  model.flush();
  model.drain(faults);
}

}  // namespace hueline::test
