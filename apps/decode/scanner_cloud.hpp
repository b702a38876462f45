#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/decode/decode_capture.hpp"
#include "core/measurements.hpp"
#include "storage/scanner_cloud_writer.hpp"
#include "sync/labelled_time.hpp"

/// The cloud of one scanner, in its own frame, with its times.
namespace hueline::apps {

/// What a first reading of a file tells of one device's time.
struct Learnt {
  sync::LabelledTime labels{1};
  sync::LabelledTime hours{1};  ///< by labels that are sure of the hour alone; used if there are no others
  bool is_scanner = false;
  bool has_counter = false;  ///< some stamps are readings of a counter
  bool has_own_counter = false;
  bool is_locked = false;  ///< the scanner said so at least once
  bool has_status = false;
  std::string words;  ///< what the scanner said of its clock at last
  HostTime first{};

  void learn(const std::vector<Measurement>& measured);
};

/// Decides what the times of a cloud are.
class CloudClock {
 public:
  CloudClock(Learnt learnt, const DecodeOptions& options);

  bool is_absolute() const { return is_absolute_; }
  /// Returns the time of a batch's first firing: GPS time if it is absolute, otherwise the counter's value as if it
  /// were one.
  GpsTime of(const LaserBatch& batch) const;
  /// Returns, for people, what the times count.
  std::string words() const;

 private:
  std::string hour_by() const;
  GpsTime near_to(HostTime received) const;

  Learnt learnt_;
  std::optional<GpsTime> near_;
  bool trusts_arrivals_;
  bool is_absolute_;
};

/// Writes the cloud of one scanner.
/// Thread safety: none.
class ScannerCloud {
 public:
  /// `scanner.cloud` is the file, whose ending chooses the format.
  ScannerCloud(DecodedScanner scanner, CloudClock clock);

  void take(const std::vector<Measurement>& measured);
  /// Completes the file. Returns why it could not be written whole.
  Status close();
  const DecodedScanner& scanner() const { return scanner_; }

 private:
  void take_batch(const LaserBatch& batch);
  void create(GpsTime first, const LaserBatch& batch);
  double seconds_of(GpsTime time) const;

  DecodedScanner scanner_;
  CloudClock clock_;
  storage::ScannerCloudWriter::Format format_;
  std::unique_ptr<storage::ScannerCloudWriter> writer_;
  std::vector<storage::ScannerPoint> points_;
  Status done_;
};

}  // namespace hueline::apps
