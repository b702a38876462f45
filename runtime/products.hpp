#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/coloured_point.hpp"
#include "core/drive_command.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"
#include "fusion/sight_judge.hpp"
#include "fusion/trajectory.hpp"
#include "runtime/health.hpp"

namespace hueline::runtime {

/// A command of the operator, with the moment and the place at which it entered the journal.
struct OperatorCommand {
  DriveCommand command;
  double drive_s = 0;             ///< s after the first packet of the recording
  double path_m = 0;              ///< driven so far
  std::optional<GpsTime> time;    ///< if GPS time is known
  std::optional<Geodetic> place;  ///< where the vehicle was, if a good solution came before
};

/// Returns the command as a line for people: "mark: NOTE", "stop".
std::string text(const OperatorCommand& command);

/// Receives what leaves the pipeline. The journal alone decides the order. A sink overrides the functions that it
/// needs. All are called on the pipeline's thread.
///
/// A trajectory that is passed with a product belongs to the pipeline and may be used during the call only. It has the
/// poses at the times of a cloud's points, or from 10 ms before an exposure or batch to 10 ms after it. These poses are
/// settled: no later solution changes them, and a pose that is missing never comes.
class ProductSink {
 public:
  virtual ~ProductSink() = default;
  /// Called once, before the first cloud, when the origin of the local level frame of the cloud and of all poses is
  /// known.
  virtual void on_origin(const Geodetic&) {}
  /// Called with points that have their places and colours.
  virtual void on_cloud(const CloudBlock&, const fusion::Trajectory&) {}
  /// Called with points as soon as they have their places, long before on_cloud() gets them with their final colours:
  /// they are coloured from the exposures that are there. For live views. This costs about as much as the final
  /// colours, so it is called only if wants_provisional_cloud() returns true.
  virtual void on_provisional_cloud(const CloudBlock&, const fusion::Trajectory&) {}
  virtual bool wants_provisional_cloud() const { return false; }
  /// Called before on_cloud() with the lines of sight that were judged for the points of the same block, if
  /// wants_sights() returns true.
  virtual void on_sights(const CloudBlock&, std::span<const fusion::JudgedSight>) {}
  virtual bool wants_sights() const { return false; }
  /// Called with every image, whole or not, before its time is known.
  virtual void on_image(const Image&) {}
  /// Called with an exposure and its image as soon as its time is known. Its pose may not be settled yet.
  virtual void on_exposure(const Exposure&) {}
  /// Called with the same exposure, without its image, once its pose is settled.
  virtual void on_settled_exposure(const Exposure&, const fusion::Trajectory&) {}
  /// Called with a batch as soon as its time is known. Its poses may not be settled yet.
  virtual void on_laser(const StampedLaserBatch&) {}
  /// Called with the same batch once its poses are settled. Batches are held for this, so it is called only if
  /// wants_settled_laser() returns true.
  virtual void on_settled_laser(const StampedLaserBatch&, const fusion::Trajectory&) {}
  virtual bool wants_settled_laser() const { return false; }
  /// Called with a time before which no exposure and no batch will come any more.
  virtual void on_watermark(GpsTime) {}
  /// Called with every solution of the POS, good or not.
  virtual void on_solution(const InsSolution&) {}
  /// Called with a message of a wheel encoder and its time.
  virtual void on_wheel(const StampedWheelSpeed&) {}
  /// Called with every GNSS fix.
  virtual void on_fix(const GnssFix&) {}
  /// `time` is empty if the clock had no relation to GPS time at the change: before it got one, or after it lost it.
  virtual void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) {
    (void)time, (void)clock, (void)state;
  }
  /// Called with every fault: those of the journal, and those that decoders, clocks and colouring make.
  virtual void on_fault(const Fault&) {}
  /// Called with every change of the drive's health.
  virtual void on_health(const HealthChange&) {}
  /// Called with every command of the operator.
  virtual void on_command(const OperatorCommand&) {}
};

}  // namespace hueline::runtime
