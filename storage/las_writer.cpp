#include "storage/las_writer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace hueline::storage {
namespace {

constexpr double kStep = 0.001;       // m
constexpr double kOffsetStep = 1000;  // offsets are whole kilometres, so that the numbers in the header are short
constexpr int kFormat = 7;

constexpr std::size_t kBuffered = 16384;  // points in one write

int day_of_year(const UtcTime& utc) {
  using namespace std::chrono;
  const sys_days day = year{utc.year} / month{static_cast<unsigned>(utc.month)} / utc.day;
  return static_cast<int>((day - sys_days(year{utc.year} / January / 1)).count()) + 1;
}

double decimal_year(const UtcTime& utc) { return utc.year + (day_of_year(utc) - 1) / 365.25; }

}  // namespace

std::string LasWriter::Config::validate() const {
  if (KeyError wrong = map.validate(); !wrong.empty()) return wrong;
  if (!from_utc(created)) return "created must be a date since 1980-01-06";
  if (system_identifier.size() > 32) return "system_identifier must have at most 32 bytes";
  if (generating_software.size() > 32) return "generating_software must have at most 32 bytes";
  if (header_every == 0) return "header_every must be at least 1";
  return {};
}

LasWriter::LasWriter(FileWriter file, Projection projection, const Config& config)
    : file_(std::move(file)), projection_(std::move(projection)), config_(config) {
  tally_.lowest.fill(std::numeric_limits<std::int32_t>::max());
  tally_.highest.fill(std::numeric_limits<std::int32_t>::min());
  in_file_ = tally_;
  next_header_ = config.header_every;
}

LasWriter::~LasWriter() {
  if (file_.is_open()) (void)close();
}

Result<LasWriter> LasWriter::create(const std::filesystem::path& path, const Geodetic& origin, const Config& config,
                                    const std::vector<LasExtraField>& extra) {
  if (std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  Result<Projection> projection = Projection::create(origin, config.map, decimal_year(config.created));
  if (!projection) return projection.error();
  Result<FileWriter> file = FileWriter::create(path, config.if_exists);
  if (!file) return file.error();
  LasWriter writer(std::move(*file), std::move(*projection), config);
  if (Status started = writer.start(extra); !started) return started.error();
  return writer;
}

Status LasWriter::start(const std::vector<LasExtraField>& extra) {
  Bytes records;
  append_vlr(records, {"LASF_Projection", 2112, "OGC WKT", projection_.operation().wkt() + '\0'});
  append_vlr(records, {"LASF_Spec", 4, "Extra bytes", encode_extra_fields(extra)});
  header_.global_encoding = kLasAdjustedTime | kLasWkt;
  header_.system_identifier = config_.system_identifier;
  header_.generating_software = config_.generating_software;
  header_.creation_year = config_.created.year;
  header_.creation_day = day_of_year(config_.created);
  header_.header_size = kLasHeaderSize14;
  header_.vlr_count = 2;
  header_.point_offset = static_cast<std::uint32_t>(kLasHeaderSize14 + records.size());
  header_.point_format = kFormat;
  std::size_t size = las_point_size(kFormat);
  for (const LasExtraField& field : extra) size += size_of(field.type);
  header_.point_size = static_cast<std::uint16_t>(size);
  buffer_.resize(kBuffered * size);
  header_.scale.fill(kStep);
  const Eigen::Vector3d origin = projection_.project(0, 0, 0);
  for (std::size_t k = 0; k < 2; ++k)
    header_.offset[k] = std::floor(origin[static_cast<Eigen::Index>(k)] / kOffsetStep) * kOffsetStep;
  const Bytes head = encode_las_header(header_);
  const ByteView pieces[] = {head, records};
  return file_.write(pieces);
}

/// Encodes the point into the buffer and counts it. Returns where its extra bytes begin, or null for a point that is
/// refused.
std::byte* LasWriter::encode(const ColouredPoint& p) {
  const Eigen::Vector3d xyz = projection_.project(p.east, p.north, p.up);
  std::array<std::int32_t, 3> steps;
  for (std::size_t k = 0; k < 3; ++k) {
    const double s = std::floor((xyz[static_cast<Eigen::Index>(k)] - header_.offset[k]) / kStep + 0.5);
    if (!(std::abs(s) < 2147483647.0)) {
      ++counts_.refused;
      return nullptr;
    }
    steps[k] = static_cast<std::int32_t>(s);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    tally_.lowest[k] = std::min(tally_.lowest[k], steps[k]);
    tally_.highest[k] = std::max(tally_.highest[k], steps[k]);
  }
  const int count = std::clamp<int>(p.return_count, 1, 15);
  const int number = std::clamp<int>(p.return_number, 1, count);
  ++tally_.points;
  ++tally_.by_return[static_cast<std::size_t>(number - 1)];
  std::byte* at = buffer_.data() + used_;
  used_ += header_.point_size;
  const auto add = [&at](auto value) {
    std::memcpy(at, &value, sizeof value);
    at += sizeof value;
  };
  const auto wide = [](std::uint8_t v) { return static_cast<std::uint16_t>(v * 257); };
  add(steps);
  add(wide(p.reflectivity));  // intensity
  add(static_cast<std::uint8_t>(number | count << 4));
  add(std::uint8_t{0});  // classification flags, scanner channel, scan direction
  add(std::uint8_t{0});  // classification: never classified
  add(std::uint8_t{0});  // user data
  add(std::int16_t{0});  // scan angle
  add(p.sensor);         // point source
  add(to_las_time(p.time));
  add(wide(p.red)), add(wide(p.green)), add(wide(p.blue));
  ++counts_.written;
  return at;
}

Status LasWriter::check(const Geodetic& origin, std::size_t extra_size) const {
  if (error_) return *error_;
  const Geodetic &a = origin, &b = projection_.origin();
  if (a.latitude != b.latitude || a.longitude != b.longitude || a.ellipsoidal_height != b.ellipsoidal_height)
    return Error{ErrorCode::Invalid, "a block of points has another origin than the cloud " + path().string()};
  if (las_point_size(kFormat) + extra_size != header_.point_size)
    return Error{ErrorCode::Invalid, "a block of points has other fields than the cloud " + path().string()};
  return {};
}

Status LasWriter::keep_header() {
  if (counts_.written < next_header_) return {};
  next_header_ = counts_.written + config_.header_every;
  return flush();
}

Status LasWriter::write_points() {
  if (error_) return *error_;
  const std::uint64_t whole = file_.size();
  const Status written = file_.write(ByteView(buffer_.data(), used_));
  used_ = 0;
  if (written) {
    in_file_ = tally_;
    return {};
  }
  error_ = written.error();
  counts_.lost += tally_.points - in_file_.points;
  counts_.written = in_file_.points;
  if (file_.cut_back(whole)) (void)write_header();  // the part that is in the file stays readable
  return written;
}

Status LasWriter::write_header() {
  header_.point_count = in_file_.points;
  header_.points_by_return = in_file_.by_return;
  for (std::size_t k = 0; k < 3 && in_file_.points > 0; ++k) {
    header_.minimum[k] = header_.offset[k] + in_file_.lowest[k] * kStep;
    header_.maximum[k] = header_.offset[k] + in_file_.highest[k] * kStep;
  }
  return file_.overwrite(0, encode_las_header(header_));
}

Status LasWriter::flush() {
  if (Status written = write_points(); !written) return written;
  Status counted = write_header();
  if (!counted) error_ = counted.error();
  return counted;
}

Status LasWriter::close() {
  if (!file_.is_open()) return Error{ErrorCode::Invalid, path().string() + " is closed"};
  const Status flushed = flush();
  const Status closed = file_.close();
  return flushed ? closed : flushed;
}

template Status LasWriter::append<kPointFields>(const Geodetic& origin, std::span<const ColouredPoint> points);

}  // namespace hueline::storage
