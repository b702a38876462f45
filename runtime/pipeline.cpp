#include "runtime/pipeline.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "core/printable.hpp"

namespace hueline::runtime {
namespace {

constexpr nanoseconds kSettledAround{10'000'000};   // promised by ProductSink
constexpr nanoseconds kAfterTheEnd{1'000'000'000};  // poses that the last data may need
constexpr std::size_t kMostUnsettled = 10'000;      // limit for the time without a watermark

GpsTime end_of(const Exposure& exposure) { return exposure.exposure_mid; }
GpsTime end_of(const StampedLaserBatch& batch) {
  std::int32_t last = 0;
  for (const LaserReturn& one : batch.returns) last = std::max(last, one.time_offset_ns);
  return batch.time + nanoseconds(last);
}

fusion::Colouring::Config with_threads(fusion::Colouring::Config config, int threads) {
  config.threads = threads;
  return config;
}

}  // namespace

Pipeline::Pipeline(const config::Rig& rig, int threads, ProductSink& sink, PostTrajectory* trajectory)
    : sink_(sink),
      trajectory_(trajectory),
      pos_(rig.sync.pos),
      decoders_(rig.sensors.size() + 1),
      synchroniser_(rig.sync),
      max_lateness_(rig.colouring.max_lateness),
      colouring_(with_threads(rig.colouring, threads), rig.geometry,
                 [this](const CloudBlock& block) {
                   health_.on_cloud(block);
                   sink_.on_cloud(block, colouring_.trajectory());
                 }),
      health_(rig) {
  if (sink.wants_provisional_cloud())
    colouring_.set_provisional_sink(
        [this](const CloudBlock& block) { sink_.on_provisional_cloud(block, colouring_.trajectory()); });
  if (sink.wants_sights())
    colouring_.set_sight_sink([this](const CloudBlock& block, std::span<const fusion::JudgedSight> sights) {
      sink_.on_sights(block, sights);
    });
  for (const auto& sensor : rig.sensors) {
    decoders_[sensor.id] = sensor.device->make_decoder();
    if (sensor.id == pos_) solutions_ = sensor.type->solutions;
    has_laser_ |= sensor.type->role == drivers::Role::Laser;
  }
  if (rig.watch.images_per_s > 0 && !rig.geometry.head.lenses.empty()) watch_.emplace(rig.geometry, rig.watch);
}

Pipeline::~Pipeline() = default;

void Pipeline::process(const Packet& packet) {
  if (packet.shed) return;
  health_.on_packet(packet);
  measurements_.clear();
  newest_ = std::max(newest_, packet.received);
  Decoder* decoder = packet.sensor < decoders_.size() ? decoders_[packet.sensor].get() : nullptr;
  if (packet.kind == PacketKind::Fault) {
    take_fault(packet, decoder);
  } else if (packet.kind == PacketKind::Wire && decoder) {
    decoder->decode(packet, measurements_);
  }
  take_measurements();
  synchroniser_.advance(packet.received, synchronised_);
  take_synchronised();
  faults_.advance(newest_);
  tell_held();
  health_.advance(newest_, synchroniser_.stream_time(), synchroniser_.clock());
  tell_health();
  if (packet.kind == PacketKind::Command) take_command(packet);
}

void Pipeline::take_command(const Packet& packet) {
  Result<DriveCommand> command = decode_command(packet.bytes.bytes());
  if (!command.ok()) return tell({kSystemSensor, FaultKind::Malformed, packet.received, 1, command.error().message});
  sink_.on_command(
      {std::move(*command), health_.drive_s(), health_.path_m(), synchroniser_.stream_time(), health_.place()});
}

void Pipeline::give(const Fault& fault) {
  health_.on_fault(fault);
  sink_.on_fault(fault);
}

void Pipeline::tell_health() {
  for (const HealthChange& change : health_.take()) sink_.on_health(change);
}

void Pipeline::take_fault(const Packet& packet, Decoder* decoder) {
  const Result<Fault> fault = decode_fault(packet.sensor, packet.received, packet.bytes.bytes());
  if (!fault.ok()) {
    return tell({packet.sensor, FaultKind::Malformed, packet.received, 1, fault.error().message});
  }
  // The stream will begin anew, so the data that the decoder still holds is decided first.
  if (decoder && fault->kind == FaultKind::Disconnected) {
    decoder->flush(measurements_);
    decoder->reset();
  }
  give(*fault);
}

void Pipeline::tell(Fault fault) {
  fault.detail = printable(fault.detail);  // the detail may quote a device
  faults_.add(std::move(fault), newest_);
  tell_held();
}

void Pipeline::tell_held() {
  for (const Fault& fault : faults_.take()) give(fault);
}

void Pipeline::take_measurements() {
  for (Measurement& measurement : measurements_) {
    health_.on_measurement(measurement, synchroniser_.clock());
    if (const auto* fix = std::get_if<GnssFix>(&measurement)) sink_.on_fix(*fix);
    if (const auto* image = std::get_if<Image>(&measurement)) sink_.on_image(*image);
    if (auto* fault = std::get_if<Fault>(&measurement)) {
      tell(std::move(*fault));
      continue;
    }
    synchroniser_.process(std::move(measurement), synchronised_);
  }
}

void Pipeline::take_synchronised() {
  for (const auto& change : synchronised_.state_changes) sink_.on_sync_state(change.time, change.clock, change.to);
  for (Fault& fault : synchronised_.faults) tell(std::move(fault));
  for (const InsSolution& solution : synchronised_.ins) {
    health_.on_solution(solution);
    if (trajectory_ == nullptr) take_solution(solution);
  }
  if (trajectory_ != nullptr)
    if (const auto now = synchroniser_.stream_time())
      trajectory_->take_until(*now, [this](const InsSolution& solution) { take_solution(solution); });
  for (const StampedWheelSpeed& wheel : synchronised_.wheels) sink_.on_wheel(wheel);
  for (const Exposure& exposure : synchronised_.exposures) {
    health_.on_exposure(exposure);
    sink_.on_exposure(exposure);
    colouring_.add(exposure);
    if (watch_) watch_->add(exposure);
    unsettled_exposures_.push_back(exposure);
    unsettled_exposures_.back().image = {};  // the buffer of the image is not held here
  }
  for (StampedLaserBatch& batch : synchronised_.laser) {
    health_.on_laser(batch);
    sink_.on_laser(batch);
    if (sink_.wants_settled_laser()) unsettled_batches_.push_back(batch);
    if (watch_) watch_->add(batch);
    colouring_.add(std::move(batch));
  }
  synchronised_.clear();
  give_settled(false);
  if (const auto watermark = synchroniser_.watermark()) {
    colouring_.advance(*watermark);
    sink_.on_watermark(*watermark);
  }
  take_faults();
}

void Pipeline::take_solution(const InsSolution& solution) {
  colouring_.add(solution);
  if (!told_origin_ && colouring_.trajectory().origin()) {
    sink_.on_origin(*colouring_.trajectory().origin());
    told_origin_ = true;
  }
  sink_.on_solution(solution);
}

void Pipeline::take_faults() {
  std::vector<Fault> faults = colouring_.take_faults();
  if (watch_)
    for (Fault& fault : watch_->take_faults()) faults.push_back(std::move(fault));
  for (Fault& fault : faults) {
    fault.time = newest_;
    tell(std::move(fault));
  }
}

/// Gives the settled exposures and batches to the sink and the watch. This comes before colouring, which forgets the
/// old part of its trajectory; the trajectory keeps what max_lateness asks for.
void Pipeline::give_settled(bool everything) {
  const fusion::Trajectory& trajectory = colouring_.trajectory();
  const auto watermark = synchroniser_.watermark();
  const auto is_pose_settled = [&](GpsTime time) {
    const GpsTime end = time + kSettledAround;
    return everything || trajectory.is_settled(end) || (watermark && *watermark >= end + max_lateness_);
  };
  const auto is_settled = [&](const auto& waiting) {
    return waiting.size() > kMostUnsettled || is_pose_settled(end_of(waiting.front()));
  };
  for (; !unsettled_exposures_.empty() && is_settled(unsettled_exposures_); unsettled_exposures_.pop_front())
    sink_.on_settled_exposure(unsettled_exposures_.front(), trajectory);
  for (; !unsettled_batches_.empty() && is_settled(unsettled_batches_); unsettled_batches_.pop_front())
    sink_.on_settled_laser(unsettled_batches_.front(), trajectory);
  if (watch_ && (watermark || everything))
    watch_->advance(everything ? GpsTime::max() : *watermark, trajectory, is_pose_settled);
}

void Pipeline::flush() {
  health_.finish();  // what follows is the end of the recording, not of a sensor
  measurements_.clear();
  for (const auto& decoder : decoders_)
    if (decoder) decoder->flush(measurements_);
  take_measurements();
  synchroniser_.flush(synchronised_);
  take_synchronised();
  if (trajectory_ != nullptr)
    if (const auto now = synchroniser_.stream_time())
      trajectory_->take_until(*now + kAfterTheEnd, [this](const InsSolution& solution) { take_solution(solution); });
  give_settled(true);
  colouring_.flush();
  take_faults();
  faults_.flush();
  tell_held();
  tell_health();
}

const DecodeCounts* Pipeline::counts(SensorId sensor) const {
  return sensor < decoders_.size() && decoders_[sensor] ? &decoders_[sensor]->counts() : nullptr;
}

const char* Pipeline::why_no_solution() const {
  if (pos_ == kSystemSensor) return "the rig has no POS";
  const DecodeCounts& got = *counts(pos_);
  if (got.decoded_bytes + got.ignored_bytes + got.malformed_bytes == 0) return "the POS sent nothing";
  if (synchroniser_.counts().ins == 0) return "the POS sent no navigation solution";
  return fusion::name(fusion::NoPose::NoSolution);
}

/// Notes which messages came instead of solutions. The states of the solutions are in the summary already.
void Pipeline::note_pos(Summary& summary) const {
  if (pos_ == kSystemSensor || synchroniser_.counts().ins > 0) return;
  std::string came;
  for (const auto& [message, count] : counts(pos_)->messages)
    came += fmt::format("{}{} {}", came.empty() ? "" : ", ", count, message);
  if (!came.empty())
    summary.on_note(
        fmt::format("the POS sent {}, and no navigation solution; a navigation solution is {}", came, solutions_));
}

/// Notes why there is no point although nothing was refused. What the scanners did instead is in their own lines.
void Pipeline::note_scanners(Summary& summary) const {
  if (!has_laser_)
    summary.on_note("the rig has no laser scanner, so there is nothing that could become a point");
  else if (synchroniser_.counts().returns == 0)
    summary.on_note("no laser return came: the lines of the scanners say what came instead");
}

void Pipeline::report(Summary& summary) const {
  for (std::size_t id = 1; id < decoders_.size(); ++id)
    if (decoders_[id]) summary.on_decoded(static_cast<SensorId>(id), decoders_[id]->counts());
  for (const sync::WheelOdometer& wheel : synchroniser_.wheels())
    summary.on_wheels(wheel.sensor(), wheel.speeds(), wheel.pulses());
  if (watch_) summary.on_watch(watch_->report());
  if (trajectory_ != nullptr) summary.on_trajectory(trajectory_->comparison());
  const fusion::ColouringCounts& counts = colouring_.counts();
  for (int i = 1; i < fusion::kNoPoseReasons; ++i) {
    const auto reason = static_cast<fusion::NoPose>(i);
    const std::uint64_t returns = counts.no_pose[static_cast<std::size_t>(i)];
    summary.on_unfused(
        fmt::format("no pose: {}", reason == fusion::NoPose::NoSolution ? why_no_solution() : fusion::name(reason)),
        returns);
    if (reason == fusion::NoPose::NoSolution && returns > 0) note_pos(summary);
  }
  note_scanners(summary);
  // Without returns none of them lacks a pose, but the user must still know that the POS would have given none.
  if (synchroniser_.counts().returns == 0) note_pos(summary);
  summary.on_returns(synchroniser_.counts().returns);
  for (const auto& [reason, returns] : synchroniser_.counts().untimed) summary.on_unfused(reason, returns);
  for (const sync::LaserClock& laser : synchroniser_.lasers())
    summary.on_unfused("no time: the clock was lost", laser.counts().returns_without_clock);
  for (const sync::SelfTimedLaser& own : synchroniser_.self_timed_lasers()) {
    summary.on_unfused("no time: read from a file, and the scanner does not say that its PPS is locked",
                       own.counts().never_locked);
    summary.on_unfused("no time: read from a file, and the scanner lost its PPS", own.counts().lost_lock);
    summary.on_unfused("no time: read from a file, and no valid message of its receiver named the scanner's hour",
                       own.counts().no_label);
    summary.on_unfused("no time: the scanner's counter leapt", own.counts().astray);
  }
  summary.on_unfused("came too late", counts.late_returns);
  summary.on_unfused("without a range", counts.empty_returns);
  summary.on_unfused("of a scanner that the rig does not have", counts.unknown_laser_returns);
}

}  // namespace hueline::runtime
