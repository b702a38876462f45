#include "storage/las_writer.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <future>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/calendar.hpp"
#include "storage/copc_format.hpp"
#include "storage/laz_format.hpp"
#include "storage/point_octree.hpp"

namespace hueline::storage {
namespace {

// Both in the map's unit.
constexpr double kGrid = 0.001;
constexpr double kOffsetStep = 1000;  // offsets are whole thousands, so that the numbers in the header are short
constexpr int kCloudFormat = 7;

constexpr std::size_t kPointsBuffered = 16384;  // points in one write of LAS

/// The record that holds the table of a LAZ file while it is written, and the bytes of each of its two places.
constexpr const char* kTableUser = "hueline";
constexpr std::uint16_t kTableRecord = 1;
constexpr std::size_t kTableRoom = 32'760;

}  // namespace

double decimal_year(const UtcTime& utc) { return utc.year + (day_of_year(utc) - 1) / 365.25; }

/// What a LAZ file needs besides the header: chunks that are being compressed, and the table of those in the file.
struct LasWriter::Compression {
  struct Chunk {
    std::future<Bytes> bytes;
    Tally tally;
  };
  LazRecord kind;
  std::deque<Chunk> chunks;  // in the order of the file
  std::vector<LazChunkSize> table;
  std::uint64_t room = 0;  // where the first place for the table begins; 0: there is none
  bool second_place = false;
  std::optional<PointOctree> tree;  // of COPC
};

LasWriter::Tally::Tally()
    : first_time(std::numeric_limits<double>::max()), last_time(std::numeric_limits<double>::lowest()) {
  lowest.fill(std::numeric_limits<std::int32_t>::max());
  highest.fill(std::numeric_limits<std::int32_t>::min());
}

void LasWriter::Tally::add(const Tally& other) {
  points += other.points;
  for (std::size_t i = 0; i < by_return.size(); ++i) by_return[i] += other.by_return[i];
  for (std::size_t k = 0; k < 3; ++k) {
    lowest[k] = std::min(lowest[k], other.lowest[k]);
    highest[k] = std::max(highest[k], other.highest[k]);
  }
  first_time = std::min(first_time, other.first_time);
  last_time = std::max(last_time, other.last_time);
}

LasWriter::LasWriter(LasWriter&&) noexcept = default;

std::string LasWriter::Config::validate() const {
  if (KeyError wrong = map.validate(); !wrong.empty()) return wrong;
  if (!from_utc(created)) return "created must be a date since 1980-01-06";
  if (system_identifier.size() > 32) return "system_identifier must have at most 32 bytes";
  if (generating_software.size() > 32) return "generating_software must have at most 32 bytes";
  if (header_every == 0) return "header_every must be at least 1";
  if (threads < 1) return "threads must be at least 1";
  if (node_points < 1) return "node_points must be at least 1";
  return {};
}

LasWriter::LasWriter(FileWriter file, Projection projection, const Config& config)
    : file_(std::move(file)), projection_(std::move(projection)), config_(config) {
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
  const bool is_compressed = config_.format != CloudFormat::Las, is_copc = config_.format == CloudFormat::Copc;
  Bytes records;
  if (is_copc) append_vlr(records, copc_info_vlr());
  records_ = {{"LASF_Projection", 2112, "OGC WKT", projection_.operation().wkt() + '\0'},
              {"LASF_Spec", 4, "Extra bytes", encode_extra_fields(extra)}};
  for (const LasVlr& record : records_) append_vlr(records, record);
  header_.global_encoding = kLasAdjustedTime | kLasWkt;
  header_.system_identifier = config_.system_identifier;
  header_.generating_software = config_.generating_software;
  header_.creation_year = config_.created.year;
  header_.creation_day = day_of_year(config_.created);
  header_.header_size = kLasHeaderSize14;
  header_.vlr_count = is_copc ? 3 : 2;
  header_.point_format = kCloudFormat;
  std::size_t size = las_point_size(kCloudFormat);
  for (const LasExtraField& field : extra) size += size_of(field.type);
  header_.point_size = static_cast<std::uint16_t>(size);
  buffer_.resize((is_compressed ? kLazChunkPoints : kPointsBuffered) * size);
  header_.scale.fill(kGrid);
  if (is_compressed) {
    laz_ = std::make_unique<Compression>();
    laz_->kind = {kCloudFormat, size};
    header_.point_format |= kLazFlag;
    append_vlr(records, laz_vlr(laz_->kind, is_copc ? kLazVariableChunks : kLazChunkPoints));
    if (is_copc)
      laz_->tree.emplace(
          PointOctree::Config{header_.scale, size, config_.node_points, config_.octree_bytes, path().parent_path()});
    ++header_.vlr_count;
    if (config_.header_every != Config::kOnlyAtTheEnd) {
      laz_->room = kLasHeaderSize14 + records.size() + kLasVlrHead;
      append_vlr(records, {kTableUser, kTableRecord, "chunk table until the end", std::string(2 * kTableRoom, '\0')});
      ++header_.vlr_count;
    }
  }
  header_.point_offset = static_cast<std::uint32_t>(kLasHeaderSize14 + records.size());
  const Eigen::Vector3d origin = projection_.project(0, 0, 0);
  for (std::size_t k = 0; k < 2; ++k)
    header_.offset[k] = std::floor(origin[static_cast<Eigen::Index>(k)] / kOffsetStep) * kOffsetStep;
  // Before the chunks of a LAZ file stands where its table is. That it is in this very place means that there is none
  // yet; programs then read the chunks one after another.
  if (laz_) storage::append(records, std::uint64_t{header_.point_offset});
  const Bytes head = header_bytes();
  const ByteView pieces[] = {head, records};
  if (Status written = file_.write(pieces); !written) return written;
  return laz_ && laz_->room ? write_table(false) : Status{};
}

/// Encodes the point into the buffer and counts it. Returns where its extra bytes begin, or null for a point that is
/// refused.
std::byte* LasWriter::encode(const ColouredPoint& p) {
  const Eigen::Vector3d xyz = projection_.project(p.east, p.north, p.up);
  std::array<std::int32_t, 3> steps;
  for (std::size_t k = 0; k < 3; ++k) {
    const double s = std::floor((xyz[static_cast<Eigen::Index>(k)] - header_.offset[k]) / kGrid + 0.5);
    if (!(std::abs(s) < 2147483647.0)) {
      ++counts_.refused;
      return nullptr;
    }
    steps[k] = static_cast<std::int32_t>(s);
  }
  const int count = std::clamp<int>(p.return_count, 1, 15);
  const int number = std::clamp<int>(p.return_number, 1, count);
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
  if (las_point_size(kCloudFormat) + extra_size != header_.point_size)
    return Error{ErrorCode::Invalid, "a block of points has other fields than the cloud " + path().string()};
  return {};
}

Status LasWriter::keep_header() {
  if (counts_.written < next_header_) return {};
  next_header_ = counts_.written + config_.header_every;
  return flush();
}

LasWriter::Tally LasWriter::tally_of(ByteView records) const {
  constexpr std::size_t kReturns = 14, kTime = 22;  // bytes in a record
  Tally out;
  for (std::size_t at = 0; at < records.size(); at += header_.point_size) {
    const std::byte* const record = records.data() + at;
    std::array<std::int32_t, 3> steps;
    std::memcpy(&steps, record, sizeof steps);
    double time;
    std::memcpy(&time, record + kTime, sizeof time);
    for (std::size_t k = 0; k < 3; ++k) {
      out.lowest[k] = std::min(out.lowest[k], steps[k]);
      out.highest[k] = std::max(out.highest[k], steps[k]);
    }
    ++out.by_return[(std::to_integer<std::size_t>(record[kReturns]) & 15) - 1];
    out.first_time = std::min(out.first_time, time);
    out.last_time = std::max(out.last_time, time);
    ++out.points;
  }
  return out;
}

/// Takes the records out of the buffer, which stays as large as it is.
Bytes LasWriter::take_buffer() {
  Bytes records(buffer_.size());
  records.swap(buffer_);
  records.resize(std::exchange(used_, 0));
  return records;
}

/// Passes on the points in the buffer: to the file, to the octree, or to a thread that compresses them.
Status LasWriter::write_points() {
  if (error_) return *error_;
  if (take_ && used_ > 0) take_(ByteView(buffer_.data(), used_));
  if (laz_ && !laz_->tree) return submit_chunk(take_buffer());
  const ByteView records(buffer_.data(), std::exchange(used_, 0));
  if (!laz_) return write_records(records, tally_of(records));
  for (std::size_t at = 0; at < records.size(); at += header_.point_size)
    if (Status added = laz_->tree->add(records.subspan(at, header_.point_size)); !added) return fail(added.error());
  return submit_nodes();
}

Status LasWriter::submit_nodes() {
  for (Bytes& records : laz_->tree->take())
    if (Status submitted = submit_chunk(std::move(records)); !submitted) return submitted;
  return {};
}

/// Compresses the records on a thread, as soon as one is free.
Status LasWriter::submit_chunk(Bytes records) {
  if (records.empty()) return {};
  while (laz_->chunks.size() >= static_cast<std::size_t>(config_.threads))
    if (Status written = write_chunk(); !written) return written;
  const Tally tally = tally_of(records);
  // Where no thread can be had, the chunk is compressed when it is written.
  const auto where = config_.threads == 1 ? std::launch::deferred : std::launch::async | std::launch::deferred;
  laz_->chunks.push_back(
      {std::async(where, [records = std::move(records), kind = laz_->kind] { return encode_laz_chunk(records, kind); }),
       tally});
  return {};
}

/// Passes on all points that are left.
Status LasWriter::submit_rest() {
  Status done = write_points();
  for (bool has_more = laz_->tree.has_value(); done && has_more;) {
    const Result<bool> finished = laz_->tree->finish_some();
    if (!finished) return fail(finished.error());
    has_more = *finished;
    done = submit_nodes();
  }
  return done;
}

/// Writes the oldest chunk that is being compressed, and waits for it if necessary.
Status LasWriter::write_chunk() {
  Compression::Chunk chunk = std::move(laz_->chunks.front());
  laz_->chunks.pop_front();
  const Bytes bytes = chunk.bytes.get();
  const Status written = write_records(bytes, chunk.tally);
  if (written) laz_->table.push_back({bytes.size(), static_cast<std::uint32_t>(chunk.tally.points)});
  return written;
}

/// Writes the bytes of these points.
Status LasWriter::write_records(ByteView bytes, const Tally& points) {
  const std::uint64_t whole = file_.size();
  const Status written = file_.write(bytes);
  if (written) {
    in_file_.add(points);
    return {};
  }
  (void)fail(written.error());
  // The part that is in the file stays readable.
  if (file_.cut_back(whole) && (!laz_ || write_table(laz_->room == 0))) (void)write_header();
  return written;
}

/// Remembers the error. The points that are not in the file yet will not come there any more.
Status LasWriter::fail(Error error) {
  error_ = std::move(error);
  counts_.lost += counts_.written - in_file_.points;
  counts_.written = in_file_.points;
  return *error_;
}

Status LasWriter::write_table(bool at_end) {
  const Bytes table = encode_laz_table(laz_->table, laz_->tree.has_value());
  std::uint64_t place = file_.size();
  if (at_end) {
    if (Status written = file_.write(table); !written) return written;
  } else {
    if (table.size() > kTableRoom) return {};  // the table of before stays
    place = laz_->room + (laz_->second_place ? kTableRoom : 0);
    laz_->second_place = !laz_->second_place;
    if (Status written = file_.overwrite(place, table); !written) return written;
  }
  return file_.overwrite(header_.point_offset, std::as_bytes(std::span(&place, 1)));
}

Status LasWriter::write_header() {
  header_.point_count = in_file_.points;
  header_.points_by_return = in_file_.by_return;
  for (std::size_t k = 0; k < 3 && in_file_.points > 0; ++k) {
    header_.minimum[k] = header_.offset[k] + in_file_.lowest[k] * kGrid;
    header_.maximum[k] = header_.offset[k] + in_file_.highest[k] * kGrid;
  }
  return file_.overwrite(0, header_bytes());
}

Bytes LasWriter::header_bytes() const {
  LasHeader header = header_;
  if (!is_finished_) header.generating_software = kLasUnfinished;
  return encode_las_header(header);
}

Status LasWriter::flush() {
  if (error_) return *error_;
  Status done;
  if (laz_) {
    while (done && !laz_->chunks.empty()) done = write_chunk();
    if (done && laz_->room) done = write_table(false);
  } else {
    done = write_points();
  }
  if (done) done = write_header();
  if (!done && !error_) error_ = done.error();
  return done;
}

/// Writes the hierarchy of a COPC file, which is the last thing in it.
Status LasWriter::write_hierarchy() {
  std::vector<LazPlace> places;
  std::uint64_t at = header_.point_offset + sizeof(std::uint64_t);
  for (const LazChunkSize& size : laz_->table) {
    places.push_back({at, size});
    at += size.bytes;
  }
  const CopcHierarchy hierarchy = encode_copc_hierarchy(laz_->tree->nodes(), places, file_.size());
  header_.evlr_offset = file_.size();
  header_.evlr_count = 1;
  Status done = file_.write(hierarchy.record);
  if (done)
    done = file_.overwrite(kCopcInfoPlace, encode_copc_info(laz_->tree->cube(), header_, hierarchy,
                                                            {in_file_.first_time, in_file_.last_time}));
  return done ? write_header() : done;
}

Status LasWriter::close() {
  if (!file_.is_open()) return Error{ErrorCode::Invalid, path().string() + " is closed"};
  if (laz_ && !error_) (void)submit_rest();  // its error is remembered
  Status flushed = flush();
  if (flushed && laz_) flushed = write_table(true);
  if (flushed && laz_ && laz_->tree && in_file_.points > 0) flushed = write_hierarchy();
  is_finished_ = flushed.ok();
  if (is_finished_) flushed = write_header();
  const Status closed = file_.close();
  return flushed ? closed : flushed;
}

template Status LasWriter::append<kPointFields>(const Geodetic& origin, std::span<const ColouredPoint> points);

}  // namespace hueline::storage
