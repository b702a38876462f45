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

/// Gives each image of one camera the event mark of its own exposure.
///
/// First by arrival: an image arrives latency_min to latency_max after its exposure, so a few marks are possible; when
/// `learn_images` images agree on one difference (mark time - camera counter), no rival difference has half as many,
/// and no image came sooner than it allows, that is the camera's relation, and the images held meanwhile are matched by
/// it. An image whose patience ends before, or with the drive, does not wait for more of them if nothing can be
/// mistaken: three that agree, none with two marks, are enough. (A periodic camera whose first `learn_images` images
/// are all delivered late by the same whole interval cannot be told from one on time.) From then on an image takes the
/// mark at the time that the relation predicts, however late it is delivered. No mark there: CameraClock, with the
/// relation's grown sigma. Two marks there: the first if they are one bounced strobe (`bounce`, sigma grown), else
/// Unmatched with a fault. No mark there, but one beside it that the image's arrival allows: clock or mark is wrong, so
/// Unmatched; after `relearn_after` of them the relation is learnt anew. If arrivals then show that the marks moved, or
/// cannot tell, sigma contains the move until marks and clock fit as before. A camera whose counter or frame number
/// falls back has restarted: its relation is learnt anew. A camera without a counter is matched by arrival alone, and
/// only where exactly one mark is possible; then latency_max must be less than the exposure interval plus latency_min.
/// Without marks (mark_input 0) the camera's counter is tied to GPS by its fastest deliveries, or is GPS time
/// (counter_offset).
///
/// exposure_mid = mark + strobe_delay + exposure / 2: the mark is the strobe's active edge, strobe_delay after it the
/// exposure starts. Every image leaves as one Exposure or is named by a fault; times never go back. Reentrant; bounded
/// memory.
class ExposureMatcher {
 public:
  /// The event that the camera's own stamp names.
  enum class StampEvent : std::uint8_t { ExposureStart, ExposureMid, ExposureEnd };

  struct Config {
    SensorId camera = kSystemSensor;
    int mark_input = 1;                                    ///< the POS's event input; 0: none is wired; [0, 8]
    nanoseconds strobe_delay{0};                           ///< mark to exposure start; [-1 s, 1 s]
    nanoseconds exposure{std::chrono::milliseconds(2)};    ///< duration; [0, 1 s]
    nanoseconds mark_sigma{std::chrono::microseconds(1)};  ///< receiver's stamp and strobe jitter; > 0
    bool has_counter = true;                               ///< Image::time means something
    nanoseconds counter_wraps{0};                          ///< period of the counter (Ladybug5 on USB: 128 s); 0: never
    /// What added to the counter gives GPS time, for a camera disciplined by PPS or PTP (TAI since 1970: -315964819 s)
    /// and without a strobe wire; checked against each arrival. Its sigma is relation.clock_sigma.
    std::optional<nanoseconds> counter_offset;
    StampEvent stamp_event = StampEvent::ExposureStart;  ///< with counter_offset; any other relation has learnt it
    nanoseconds stamp_delay{0};  ///< event to stamp, with counter_offset (Ladybug5+: exposure end + 45 us)
    nanoseconds latency_min{std::chrono::milliseconds(5)};         ///< exposure start to complete image here; >= 0
    nanoseconds latency_max{std::chrono::milliseconds(90)};        ///< the same; above latency_min, at most 5 s
    nanoseconds mark_latency_max{std::chrono::milliseconds(250)};  ///< mark to its message here; [1 ms, 5 s]
    nanoseconds bounce{std::chrono::milliseconds(1)};              ///< marks this close are one strobe; [0, 100 ms]
    int learn_images = 10;  ///< [2, 64], below pending_limit or the first images stay unmatched
    nanoseconds learn_tolerance{std::chrono::milliseconds(2)};  ///< of the difference while learning; [1 us, 50 ms]
    int relearn_after = 6;           ///< images in a row without the predicted mark, though others came; [2, 100]
    std::size_t pending_limit = 16;  ///< images held at most (they pin their buffers); [1, 1000]
    std::size_t mark_limit = 256;    ///< marks held at most; [16, 1e5]
    nanoseconds patience{std::chrono::seconds(5)};  ///< an image waits at most this long for a relation; [100 ms, 60 s]
    CameraRelation::Config relation{};
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit ExposureMatcher(Config config);

  /// `arrival`: GPS time of image.received.
  void add(Image image, const GpsStamp& arrival, std::vector<Exposure>& out);
  void add(const EventMark& mark, std::vector<Exposure>& out);
  /// Stream time: nothing sent before `now` less its latency is still to come.
  void advance(GpsTime now, HostTime received, std::vector<Exposure>& out);
  /// The end: nothing more will come.
  void flush(std::vector<Exposure>& out);
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  /// No exposure earlier than this will come, while deliveries keep to latency_max.
  GpsTime watermark(GpsTime now) const;
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
  struct Pending {
    Image image;
    GpsStamp arrival;
    std::int64_t counter = 0;  // unwrapped
  };
  bool accept(const Image& image, std::int64_t& counter);
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
  std::deque<Mark> marks_;       // by time
  std::deque<Pending> pending_;  // by counter
  std::optional<std::uint64_t> last_frame_;
  std::int64_t last_raw_ = 0, last_counter_ = 0;
  std::optional<GpsTime> last_out_;
  GpsTime now_{};
  HostTime received_{};
  std::uint64_t unexplained_frames_ = 0;  // frame numbers missing whose marks have not been seen to go unused
  int missed_in_a_row_ = 0;
  std::deque<nanoseconds> latencies_;      // mark to arrival of the last matched images
  std::optional<CameraRelation> trusted_;  // that marks and clock left together; null: they did not
  nanoseconds trusted_latency_{0};         // its fastest image
  nanoseconds doubt_{0};                   // how far marks or clock have moved from it
};

}  // namespace hueline::sync
