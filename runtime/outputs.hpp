#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "config/rig.hpp"
#include "core/output_file.hpp"
#include "runtime/disk_reserve.hpp"
#include "runtime/products.hpp"
#include "runtime/summary.hpp"
#include "storage/view_writer.hpp"

namespace hueline::runtime {

/// Everything that a drive's folder receives besides the raw recording: cloud.las, view.mcap, summary.json. The same
/// class serves capture and replay. A write that fails is said once and ends that file; the others go on. Thread-bound
/// (the pipeline's).
class Outputs : public ProductSink {
 public:
  /// Hears at once, on the thread that writes, why a file ends early.
  using Tell = std::function<void(const std::string& trouble)>;

  /// Makes the folder, holds it for itself and makes sure that the files could be written: before hours of driving find
  /// out. Errors: Io; Unavailable if another capture or replay writes there.
  static Result<std::unique_ptr<Outputs>> create(const config::Rig& rig, const std::filesystem::path& dir, Tell tell);
  ~Outputs() override;

  void on_origin(const Geodetic& origin) override;
  void on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) override;
  void on_exposure(const Exposure& exposure) override;
  void on_solution(const InsSolution& solution) override;
  void on_fix(const GnssFix& fix) override;
  void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) override;
  void on_fault(const Fault& fault) override;

  /// While a recording goes on beside them: cloud and view end where the disk's last space begins. `reserve` must
  /// outlive this.
  void keep(const DiskReserve& reserve) { reserve_ = &reserve; }

  /// Closes the files and writes summary.json. The first error of any file.
  Status finish();

  Summary& summary() { return summary_; }

 private:
  struct Files;
  Outputs(const config::Rig& rig, OutputFolder folder, Tell tell);
  void keep(const char* file, Status done);
  bool has_room();
  void log(std::optional<GpsTime> time, storage::ViewWriter::Level level, const std::string& who, std::string text);
  template <class Append>
  void view(Append append);

  const OutputFolder folder_;
  const std::filesystem::path dir_;
  const Tell tell_;
  Summary summary_;
  std::unique_ptr<Files> files_;
  Status first_error_;
  const DiskReserve* reserve_ = nullptr;
  bool is_reserved_ = false;       // the disk's last space was reached
  std::optional<GpsTime> newest_;  // of the POS: when a fault without GPS time is shown
};

}  // namespace hueline::runtime
