#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/rig.hpp"
#include "core/output_file.hpp"
#include "runtime/disk_reserve.hpp"
#include "runtime/drive_map.hpp"
#include "runtime/products.hpp"
#include "runtime/summary.hpp"
#include "storage/byte_order.hpp"
#include "storage/view_writer.hpp"

namespace hueline::runtime {

/// Writes everything in a drive's folder besides the raw recording: the cloud and its parts, view.mcap, summary.json,
/// report.html and report.pdf. Capture and replay use the same class. A write that fails is reported once and ends that
/// file; the other files continue. Thread safety: none; the pipeline's thread calls all functions.
class Outputs : public ProductSink {
 public:
  /// Called at once, on the thread that writes, with the reason why a file ends early, or with a drift of the
  /// calibration, which somebody in the vehicle may mend.
  using Tell = std::function<void(const std::string& trouble)>;

  /// Creates the folder, locks it for this run and checks that the files can be written, so that a problem shows before
  /// hours of driving. Errors: Io; Unavailable if another capture or replay writes there.
  static Result<std::unique_ptr<Outputs>> create(const config::Rig& rig, const std::filesystem::path& dir, Tell tell);
  ~Outputs() override;

  void on_origin(const Geodetic& origin) override;
  void on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) override;
  void on_exposure(const Exposure& exposure) override;
  void on_solution(const InsSolution& solution) override;
  void on_fix(const GnssFix& fix) override;
  void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) override;
  void on_fault(const Fault& fault) override;
  void on_health(const HealthChange& change) override;
  void on_command(const OperatorCommand& command) override;

  /// Also gives each change of the health to `tell`, on the thread that writes.
  void tell_health(std::function<void(const HealthChange&)> tell) { tell_health_ = std::move(tell); }

  /// To be called if a recording is being written at the same time: cloud and view then end where the disk's last space
  /// begins. `reserve` must outlive this object.
  void keep(const DiskReserve& reserve) { reserve_ = &reserve; }

  /// Closes the files and writes summary.json. Returns the first error of any file.
  /// With `health`, of the pipeline after its flush(), the drive is judged, and report.html and report.pdf are
  /// written. Nobody holds the folder afterwards.
  Status finish(const Health* health = nullptr);

  Summary& summary() { return summary_; }
  const DriveMap& map() const { return map_; }

 private:
  struct Files;
  Outputs(const config::Rig& rig, OutputFolder folder, Tell tell);
  void keep(const char* file, Status done);
  bool has_room();
  void close_cloud();
  void begin_parts();
  void add_to_parts(storage::ByteView records);
  void end_parts();
  struct Line;
  void log(Line line);
  template <class Append>
  void view(Append append);

  std::optional<OutputFolder> folder_;
  const std::filesystem::path dir_;
  const Tell tell_;
  std::function<void(const HealthChange&)> tell_health_;
  const config::Rig rig_;
  Summary summary_;
  DriveMap map_;
  std::unique_ptr<Files> files_;
  Status first_error_;
  std::vector<SensorId> cameras_;  // only the watch over mounting and times doubts them
  const DiskReserve* reserve_ = nullptr;
  bool is_reserved_ = false;       // the disk's last space was reached
  std::optional<GpsTime> newest_;  // newest time of the POS; a fault without GPS time is shown at this time
};

}  // namespace hueline::runtime
