#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/stamped.hpp"
#include "sync/arrival_line.hpp"
#include "sync/camera_relation.hpp"
#include "sync/fault_log.hpp"
#include "sync/host_clock_model.hpp"
#include "sync/relation_learner.hpp"

namespace hueline::sync {

/// Assigns to each image of one camera the event mark of its exposure.
///
/// First phase, by arrival. An image arrives latency_min to latency_max after its exposure, so only a few marks are
/// possible. The relation of the camera's counter to the marks is found when `learn_images` images agree on one
/// difference (mark time - camera counter), no other difference has half as many images, and no image arrived earlier
/// than the difference allows. The images that were held meanwhile are then matched by it. If the patience of an image
/// ends, or the drive ends, three images are enough, provided that they agree and that none has two possible marks. (If
/// the first `learn_images` images of a periodic camera are all delivered late by the same number of whole intervals,
/// this cannot be distinguished from images on time.)
///
/// Second phase, by the relation. An image takes the mark at the predicted time, however late the image is delivered:
///
///   marks near the predicted time       result
///   one                                 EventMark
///   several within `bounce`             EventMark: the first mark of a bounced strobe; sigma is grown
///   several further apart               Unmatched, with a fault
///   none, and none beside it            CameraClock, with the grown sigma of the relation
///   none, but one beside it that the    Unmatched, because either the clock or the mark is wrong
///   image's arrival allows
///
/// After `relearn_after` consecutive images without a mark at the predicted time, although other marks came, the
/// relation is learnt again. If arrivals then show that the marks have moved, or do not show what has moved, sigma
/// includes the move until marks and clock fit as before. If an image arrives earlier than possible after the mark that
/// fits, the image is Unmatched, and the relation is learnt again at once.
///
/// Special cases:
/// - If the camera's counter or frame number falls, the camera has restarted, and its relation is learnt again.
/// - A camera without a counter is matched by arrival alone, and only if exactly one mark is possible. latency_max must
///   then be less than the exposure interval plus latency_min.
/// - Without marks (mark_input 0), the camera's counter is tied to GPS time by its fastest deliveries, or it is GPS
///   time (counter_offset).
///
/// exposure_mid = mark + strobe_delay + duration / 2. The mark is the active edge of the strobe; the exposure starts
/// strobe_delay after it. The duration is what the camera reports with the image (Image::reported), because a camera
/// that exposes automatically changes it from image to image; if it reports none, `exposure`. Each image gives one
/// Exposure or is reported by a fault; the times never decrease. Memory is bounded. Thread safety: one thread per
/// object.
class ExposureMatcher {
 public:
  /// The event that the camera's own stamp names.
  enum class StampEvent : std::uint8_t { ExposureStart, ExposureMid, ExposureEnd };

  struct Config {
    SensorId camera = kSystemSensor;
    int mark_input = 1;           ///< the POS's event input; 0: no strobe is connected; [0, 4]
    nanoseconds strobe_delay{0};  ///< from the mark to the start of the exposure; [-1 s, 1 s]
    /// Duration of an exposure that the camera does not report; [0, 1 s].
    nanoseconds exposure{std::chrono::milliseconds(2)};
    /// Whether the camera chooses its exposures. An image without their report is then Unmatched.
    bool must_report = false;
    /// One sigma of the receiver's stamp and of the strobe's jitter; > 0.
    nanoseconds mark_sigma{std::chrono::microseconds(1)};
    bool has_counter = true;       ///< Image::time is meaningful
    nanoseconds counter_wraps{0};  ///< period of the counter (Ladybug5 on USB: 128 s); 0: it never wraps
    /// Counter plus counter_offset is GPS time, for a camera that is disciplined by PPS or PTP (TAI since 1970:
    /// -315964819 s) and has no strobe wire. Each arrival checks it. Its sigma is relation.clock_sigma.
    std::optional<nanoseconds> counter_offset;
    /// Used with counter_offset, and with reported durations; a learnt relation includes what is constant.
    StampEvent stamp_event = StampEvent::ExposureStart;
    /// From the event to the camera's stamp (Ladybug5+: exposure end + 45 us). Used with counter_offset only.
    nanoseconds stamp_delay{0};
    /// Smallest time from the start of the exposure to the arrival of the complete image; >= 0.
    nanoseconds latency_min{std::chrono::milliseconds(5)};
    /// Largest time from the start of the exposure to the arrival of the complete image; above latency_min, up to 5 s.
    nanoseconds latency_max{std::chrono::milliseconds(90)};
    /// Largest time from a mark to the arrival of its message; [1 ms, 5 s].
    nanoseconds mark_latency_max{std::chrono::milliseconds(250)};
    nanoseconds bounce{std::chrono::milliseconds(1)};  ///< marks this close together are one strobe; [0, 100 ms]
    /// Images that must agree; [2, 64]. It must be below pending_limit, otherwise the first images stay unmatched.
    int learn_images = 10;
    /// How much differences may vary while learning; [1 us, 50 ms].
    nanoseconds learn_tolerance{std::chrono::milliseconds(2)};
    /// Consecutive images without the predicted mark, although other marks came; [2, 100].
    int relearn_after = 6;
    std::size_t pending_limit = 16;                 ///< images held at most; each keeps its buffer in use; [1, 1000]
    std::size_t mark_limit = 256;                   ///< marks held at most; [16, 1e5]
    nanoseconds patience{std::chrono::seconds(5)};  ///< how long an image waits for a relation at most; [100 ms, 60 s]
    CameraRelation::Config relation{};
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit ExposureMatcher(Config config);

  /// Adds an image; `arrival` is the GPS time of image.received.
  void add(Image image, const GpsStamp& arrival, std::vector<Exposure>& out);
  /// Adds an event mark; marks of other inputs are ignored.
  void add(const EventMark& mark, std::vector<Exposure>& out);
  /// Tells that stream time is `now`: everything that was sent before `now` minus its latency has arrived.
  void advance(GpsTime now, HostTime received, std::vector<Exposure>& out);
  /// Ends the stream: nothing more will arrive.
  void flush(std::vector<Exposure>& out);
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  /// Returns a time before which no exposure will come any more, as long as deliveries keep latency_max.
  GpsTime watermark(GpsTime now) const;
  /// Returns true if the relation of the camera's counter to the marks is known.
  bool is_learnt() const { return relation_.is_known(); }

  struct Counts {
    std::uint64_t images = 0, marks = 0, by_mark = 0, by_camera_clock = 0, unmatched = 0;
    std::uint64_t lost_images = 0, lost_marks = 0, spurious_marks = 0, bounced_marks = 0, marks_of_lost_images = 0;
    std::uint64_t repeated_images = 0, late_images = 0, restarts = 0, relearnt = 0;
  };
  const Counts& counts() const { return counts_; }

 private:
  struct Mark {
    GpsTime time{};
    HostTime received{};
    bool used = false;
  };
  /// How long an image was exposed.
  struct Length {
    nanoseconds mean{0}, longest{0};  // of its parts
    bool is_reported = false;         // by the camera
  };
  struct Pending {
    Image image;
    GpsStamp arrival;
    std::int64_t counter = 0;  // continued over the counter's wraps, at the start of the exposure
    Length length;
  };
  bool accept(const Image& image, std::int64_t& counter);
  Length length_of(const Image& image) const;
  nanoseconds into_exposure(const Length& length) const;
  void restart(const Image& image, const char* why, std::vector<Exposure>& out);
  void forget(bool was_right);
  bool has_rival(const Pending& pending, GpsTime predicted, nanoseconds gate) const;
  void compare_with_trusted();
  bool is_too_early(GpsTime arrival, GpsTime mark, nanoseconds sigma) const;
  void learn(bool final);
  void work(bool final, std::vector<Exposure>& out);
  bool match_by_relation(Pending& pending, bool final, std::vector<Exposure>& out);
  bool match_by_arrival(Pending& pending, bool final, std::vector<Exposure>& out);
  void time_without_mark(Pending& pending, std::vector<Exposure>& out);
  void emit(Pending& pending, GpsTime mark, double sigma_ns, ExposureTiming timing, std::vector<Exposure>& out);
  void emit_unmatched(Pending& pending, const std::string& why, std::vector<Exposure>& out);
  void note_bounce(std::size_t extra, HostTime at);
  void expire_marks();
  GpsTime guess(const Pending& pending) const;

  Config config_;
  CameraRelation relation_;
  RelationLearner learner_;
  ArrivalLine line_;
  FaultLog faults_;
  Counts counts_;
  std::deque<Mark> marks_;       // in order of time
  std::deque<Pending> pending_;  // in order of the counter
  std::optional<std::uint64_t> last_frame_;
  std::int64_t last_raw_ = 0, last_counter_ = 0;
  std::optional<GpsTime> last_out_;
  nanoseconds last_duration_{0};  // of the exposure at last_out_
  GpsTime now_{};
  HostTime received_{};
  // Missing frame numbers whose marks have not been found unused yet.
  std::uint64_t unexplained_frames_ = 0;
  int missed_in_a_row_ = 0;
  std::deque<nanoseconds> latencies_;  // from mark to arrival, of the last matched images
  // The relation before marks and clock moved apart; empty if they did not.
  std::optional<CameraRelation> trusted_;
  nanoseconds trusted_latency_{0};  // smallest latency under trusted_
  nanoseconds doubt_{0};            // how far marks or clock have moved from trusted_
};

}  // namespace hueline::sync
