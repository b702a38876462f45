#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/stream/nmea_form.hpp"

namespace hueline::drivers {

/// Joins the NMEA 0183 sentences of one epoch, of any talker, into measurements.
///
///   sentences                                        measurement
///   GGA, GNS                                         GnssFix, with the date of RMC or ZDA and the sigmas of GST
///   RMC, ZDA                                         TimeLabel, for the first epoch of each second
///   PASHR (roll, pitch, heading) and GGA             InsSolution, with the velocity of VTG or RMC
///   times of day that contradict each other          Fault LabelConflict
///
/// The sentences of an epoch have the same time of day. An epoch is complete with the sentence that was the last one of
/// the epoch before, or with a sentence of a later epoch. Without a date (RMC or ZDA) nothing can be stamped: a Fault
/// NoTime says so. Positions in RMC or GLL alone are not used, because they have no height and do not say how good they
/// are: a Fault Implausible says so. Of several GGA of one moment that of the talker GN is used, or else the best one:
/// some receivers also send the solutions of single systems (GPGGA, BDGGA). NMEA times are UTC: they become GPS time
/// with the table of leap seconds.
///
/// HDT and THS are not used: they are the heading of two antennas, not of the vehicle.
/// Thread safety: none; one thread calls all functions.
class NmeaEpoch {
 public:
  /// Takes a sentence. Appends the measurements of an epoch that is complete now; their sensor is not set. Returns
  /// whether the sentence is used.
  bool take(const NmeaSentence& sentence, HostTime received, std::vector<Measurement>& out);
  /// Ends the stream: appends the measurements of the last epoch.
  void finish(std::vector<Measurement>& out);
  /// Forgets the epoch that is not complete, because the stream was interrupted.
  void forget();

 private:
  /// What the sentences of one epoch said.
  struct Epoch {
    Epoch() {}  // without it clang 14 cannot make one inside an optional of the enclosing class
    nanoseconds time_of_day{0};
    unsigned seen = 0;
    bool is_again = false;    ///< an epoch of the same time was complete before
    HostTime received{};      ///< of its position
    HostTime latest{};        ///< of its latest sentence
    HostTime dated{};         ///< of its latest sentence with a date
    bool has_date = false;    ///< one of its own sentences has the date
    bool is_valid = false;    ///< the receiver calls its time valid
    bool is_doubted = false;  ///< its sentences name different days
    bool has_height = false;  ///< above the ellipsoid
    bool is_aligned = false;
    std::optional<Geodetic> place;
    unsigned place_from = 0;  ///< the sentence that the place is from, as a bit
    int quality = 0;
    int satellites = 0;
    std::optional<double> hdop;
    std::optional<std::array<double, 3>> sigma_enu;
    std::optional<double> speed, track;  ///< m/s, degrees
    std::optional<Attitude> attitude;
    std::optional<std::array<double, 3>> attitude_sigma;
  };
  struct Date {
    int year = 0, month = 0, day = 0;
    bool operator==(const Date&) const = default;
  };
  struct Closed {
    nanoseconds time_of_day{0};
    unsigned seen = 0;
  };

  void open(nanoseconds time_of_day, unsigned part, std::vector<Measurement>& out);
  void close(std::vector<Measurement>& out);
  void note_lone_position(HostTime received, std::vector<Measurement>& out);
  void tell_lone_positions(std::vector<Measurement>& out);
  void take_date(const Date& date, HostTime received, std::vector<Measurement>& out);
  std::optional<GpsTime> time_of(const Epoch& epoch) const;

  std::optional<Epoch> epoch_;
  std::optional<Closed> closed_;     // the epoch before
  unsigned usual_ = 0;               // the sentences of the epoch before
  unsigned late_ = 0;                // sentences of this time that came before the epoch was taken for complete
  std::optional<Date> date_;         // the latest that was named
  nanoseconds date_at_{0};           // the time of day that it was named with
  std::optional<GpsTime> labelled_;  // the latest second that a label named
  bool has_no_time_ = false;
  bool knows_quality_ = false;  // a GGA or GNS came, which says how good a position is
  int lone_positions_ = 0;      // positions of RMC and GLL before one came
  HostTime lone_at_{};          // of the latest of them
  bool has_told_lone_ = false;
};

}  // namespace hueline::drivers
