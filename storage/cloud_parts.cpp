#include "storage/cloud_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <system_error>

#include "core/calendar.hpp"
#include "core/input_file.hpp"
#include "core/output_file.hpp"
#include "storage/file_writer.hpp"
#include "storage/part_index.hpp"

namespace hueline::storage {
namespace {

constexpr std::size_t kBlockBytes = 1 << 16;
constexpr std::int64_t kMostStrips = std::numeric_limits<std::uint16_t>::max();
constexpr nanoseconds kFirstPoints = std::chrono::seconds(1);  // the earliest of these is that of the cloud
constexpr const char* kUnfinished = ".part";
// Where fields are in a record.
constexpr std::size_t kReturnsAt = 14, kUserDataAt = 17;
constexpr std::size_t source_at(int point_format) { return point_format < 6 ? 18 : 20; }

Error too_many(const std::string& parts, const CloudSplit& split) {
  return {ErrorCode::Invalid,
          fmt::format("there would be more than {}: give a greater size than {}", parts, split.text())};
}

}  // namespace

Error CloudParts::too_many_tiles(const CloudSplit& split) {
  return too_many(fmt::format("{} tiles", kMostTiles), split);
}

CloudParts::Tally::Tally() = default;

void CloudParts::Tally::add(const Tally& other) {
  if (points == 0) {
    *this = other;
    return;
  }
  if (other.points == 0) return;
  points += other.points;
  for (std::size_t i = 0; i < by_return.size(); ++i) by_return[i] += other.by_return[i];
  for (std::size_t k = 0; k < 3; ++k) {
    minimum[k] = std::min(minimum[k], other.minimum[k]);
    maximum[k] = std::max(maximum[k], other.maximum[k]);
  }
  first_time = std::min(first_time, other.first_time);
  last_time = std::max(last_time, other.last_time);
}

CloudParts::Tally CloudParts::Form::tally_of(ByteView records) const {
  const auto mask = kind.format < 6 ? std::byte{7} : std::byte{15};
  Tally out;
  for (std::size_t at = 0; at < records.size(); at += kind.size) {
    const std::byte* const record = records.data() + at;
    std::array<std::int32_t, 3> steps;
    std::memcpy(&steps, record, sizeof steps);
    Tally one;
    one.points = 1;
    if (time_at() != 0) std::memcpy(&one.first_time, record + time_at(), sizeof one.first_time);
    one.last_time = one.first_time;
    for (std::size_t k = 0; k < 3; ++k) one.minimum[k] = one.maximum[k] = steps[k] * scale[k] + offset[k];
    if (const auto number = std::to_integer<std::size_t>(record[kReturnsAt] & mask); number > 0)
      one.by_return[number - 1] = 1;
    out.add(one);
  }
  return out;
}

CloudParts::CloudParts(std::filesystem::path folder, Config config)
    : folder_(std::move(folder)), config_(std::move(config)) {}

Result<CloudParts> CloudParts::create(const std::filesystem::path& folder, Config config) {
  LasHeader& header = config.header;
  header.point_format &= kLasFormatBits;
  CloudParts out(folder, std::move(config));
  out.form_ = {{out.config_.header.point_format, out.config_.header.point_size},
               out.config_.header.scale,
               out.config_.header.offset};
  const LazRecord& kind = out.form_.kind;
  if (!is_laz_record(kind))
    return Error{ErrorCode::Invalid, "point format " + std::to_string(kind.format) +
                                         " cannot be written as LAZ: formats " + kLazFormats + " can"};
  if (out.is_strips() && (out.form_.time_at() == 0 || (out.config_.header.global_encoding & kLasAdjustedTime) == 0))
    return Error{ErrorCode::Invalid,
                 "the times of the cloud have no week: it cannot be cut into strips (tile:100m can)"};
  out.block_records_ = std::max<std::size_t>(1, kBlockBytes / kind.size);
  for (const LasVlr& record : out.config_.records) append_vlr(out.vlrs_, record);
  append_vlr(out.vlrs_, laz_vlr(kind, kLazChunkPoints));
  if (!out.is_strips()) out.base_ = 0;
  return out;
}

Status CloudParts::fail(Error error) {
  if (!error_) error_ = std::move(error);
  return *error_;
}

GpsTime CloudParts::time_of(const std::byte* record) const {
  double seconds;
  std::memcpy(&seconds, record + form_.time_at(), sizeof seconds);
  return from_las_time(seconds);
}

CloudParts::Cell CloudParts::cell_of(const std::byte* record) const {
  if (!is_strips()) {
    std::array<std::int32_t, 2> steps;
    std::memcpy(&steps, record, sizeof steps);
    const auto cell = [&](std::size_t k) {
      return static_cast<std::int64_t>(std::floor((steps[k] * form_.scale[k] + form_.offset[k]) / config_.tile_edge));
    };
    return {cell(0), cell(1)};
  }
  const std::int64_t strip = strip_at(time_of(record));
  return {base_ ? std::max(strip, *base_) : strip, 0};
}

std::int64_t CloudParts::strip_at(GpsTime time) const {
  return config_.split.kind == CloudSplit::Kind::Time
             ? count_ns(time) / std::max<std::int64_t>(1, from_seconds(config_.split.size).count())
             : std::upper_bound(ends_.begin(), ends_.end(), time) - ends_.begin();
}

/// Returns a strip's number; 0 for a tile.
std::uint16_t CloudParts::strip_of(const Part& part) const {
  return is_strips() ? static_cast<std::uint16_t>(part.cell.first - *base_ + 1) : std::uint16_t{0};
}

Result<CloudParts::Part*> CloudParts::part_of(const Cell& cell) {
  if (latest_ != nullptr && latest_->cell == cell) return latest_;
  std::unique_ptr<Part>& part = parts_[cell];
  if (!part) {
    const bool is_too_many = is_strips() ? base_ && cell.first - *base_ >= kMostStrips : parts_.size() > kMostTiles;
    if (is_too_many) {
      parts_.erase(cell);
      return fail(is_strips()
                      ? too_many(fmt::format("{} strips, which LAS has no numbers for", kMostStrips), config_.split)
                      : too_many_tiles(config_.split))
          .error();
    }
    part = std::make_unique<Part>();
    part->cell = cell;
  }
  latest_ = part.get();
  return latest_;
}

void CloudParts::put(Part& part, const std::byte* record) {
  const std::size_t at = part.waiting % block_records_;
  if (at == 0) {
    if (free_.empty()) free_.push_back(std::make_unique_for_overwrite<std::byte[]>(block_records_ * form_.kind.size));
    part.blocks.push_back(std::move(free_.back()));
    free_.pop_back();
    ++used_blocks_;
  }
  std::memcpy(part.blocks.back().get() + at * form_.kind.size, record, form_.kind.size);
  ++part.waiting;
  part.last_use = ++number_;
}

/// Takes the first records that wait.
Bytes CloudParts::take(Part& part, std::size_t count) {
  const std::size_t size = form_.kind.size;
  Bytes out(part.waiting * size);
  for (std::size_t i = 0; i < part.blocks.size(); ++i) {
    const std::size_t begin = i * block_records_, records = std::min(block_records_, part.waiting - begin);
    std::memcpy(out.data() + begin * size, part.blocks[i].get(), records * size);
  }
  used_blocks_ -= part.blocks.size();
  for (Block& block : part.blocks) free_.push_back(std::move(block));
  part.blocks.clear();
  const std::size_t rest = std::exchange(part.waiting, 0) - count;
  for (std::size_t i = 0; i < rest; ++i) put(part, out.data() + (count + i) * size);
  out.resize(count * size);
  return out;
}

Status CloudParts::add(ByteView records) {
  const std::size_t size = form_.kind.size;
  if (!base_ && config_.earliest) base_ = strip_at(*config_.earliest);
  for (std::size_t at = 0; at < records.size(); at += size) {
    if (error_) return *error_;
    const std::byte* const record = records.data() + at;
    if (!base_) {
      const GpsTime time = time_of(record);
      earliest_ = std::min(earliest_.value_or(time), time);
      newest_ = std::max(newest_.value_or(time), time);
      if (*newest_ - *earliest_ >= kFirstPoints) fix_base();
    }
    const Result<Part*> part = part_of(cell_of(record));
    if (!part) return part.error();
    put(**part, record);
    if (!base_ && used_blocks_ * block_records_ * size > config_.held_bytes / 2) fix_base();
    if (base_ && (*part)->tail_points + (*part)->waiting >= kLazChunkPoints)
      if (Status submitted = submit(**part, false); !submitted) return submitted;
    if (used_blocks_ * block_records_ * size > config_.held_bytes)
      if (Status made = make_room(); !made) return made;
  }
  return {};
}

/// Numbers the strips from that of the earliest point on.
void CloudParts::fix_base() {
  if (!base_) base_ = strip_at(earliest_.value_or(GpsTime{}));
}

/// Compresses what waits for the parts to which no point has come for the longest.
Status CloudParts::make_room() {
  fix_base();
  std::vector<Part*> oldest;
  for (auto& [cell, part] : parts_)
    if (part->waiting > 0) oldest.push_back(part.get());
  std::sort(oldest.begin(), oldest.end(), [](const Part* a, const Part* b) { return a->last_use < b->last_use; });
  for (Part* const part : oldest) {
    if (used_blocks_ * block_records_ * form_.kind.size <= config_.held_bytes / 2) break;
    if (Status submitted = submit(*part, true); !submitted) return submitted;
  }
  return {};
}

Status CloudParts::submit(Part& part, bool with_rest) {
  while (part.waiting > 0) {
    const std::size_t room = kLazChunkPoints - part.tail_points;
    if (part.waiting < room && !with_rest) return {};
    if (Status submitted = submit_chunk(part, std::min(part.waiting, room)); !submitted) return submitted;
  }
  return {};
}

/// Compresses the first records that wait, together with the last chunk of the file if that is not full.
Status CloudParts::submit_chunk(Part& part, std::size_t count) {
  Bytes tail;
  const std::size_t tail_points = part.tail_points;
  if (tail_points > 0) {
    if (std::ranges::find(underway_, &part, &Underway::part) != underway_.end())
      if (Status written = write_underway(); !written) return written;
    Result<Bytes> read = read_tail(part);
    if (!read) return fail(read.error());
    tail = std::move(*read);
  }
  const auto threads = static_cast<std::size_t>(config_.threads);
  while (underway_.size() >= threads)
    if (Status written = write_oldest(); !written) return written;
  Bytes records = take(part, count);
  if (is_strips()) {
    const std::size_t source = source_at(form_.kind.format);
    for (std::size_t at = 0; at < records.size(); at += form_.kind.size) {
      std::uint16_t scanner;
      std::memcpy(&scanner, &records[at + source], sizeof scanner);
      records[at + kUserDataAt] = static_cast<std::byte>(std::min<std::uint16_t>(scanner, 255));
      storage::put(records, at + source, strip_of(part));
    }
  }
  const bool is_full = tail_points + count == kLazChunkPoints;
  part.tail_points = is_full ? 0 : static_cast<std::uint32_t>(tail_points + count);
  // Where no thread can be had, the chunk is compressed when it is written.
  const auto where = threads == 1 ? std::launch::deferred : std::launch::async | std::launch::deferred;
  underway_.push_back(
      {&part,
       std::async(where,
                  [form = form_, tail = std::move(tail), tail_points, records = std::move(records)]() mutable {
                    return pack(form, tail, tail_points, std::move(records));
                  }),
       is_full});
  return {};
}

Result<CloudParts::Packed> CloudParts::pack(const Form& form, const Bytes& tail, std::size_t tail_points,
                                            Bytes records) {
  if (tail_points > 0) {
    Bytes before;
    const Result<std::size_t> unpacked = decode_laz_chunk(tail, form.kind, tail_points, before);
    if (!unpacked) return unpacked.error();
    append(before, records);
    records = std::move(before);
  }
  return Packed{encode_laz_chunk(records, form.kind), form.tally_of(records)};
}

Status CloudParts::write_underway() {
  while (!underway_.empty())
    if (Status written = write_oldest(); !written) return written;
  return {};
}

Status CloudParts::write_oldest() {
  Underway one = std::move(underway_.front());
  underway_.pop_front();
  const Result<Packed> packed = one.packed.get();
  if (error_) return *error_;
  if (!packed) return fail({packed.error().code, one.part->path.string() + ": " + packed.error().message});
  return write_chunk(*one.part, *packed, one.is_full);
}

Result<Bytes> CloudParts::read_tail(const Part& part) const {
  const Result<InputFile> file = InputFile::open(part.path);
  if (!file) return file.error();
  Bytes out(part.tail_bytes);
  if (Status read = file->read(part.whole_bytes, out); !read) return read.error();
  return out;
}

LasHeader CloudParts::header_of(const Tally& tally, std::uint16_t strip) const {
  LasHeader out = config_.header;
  out.version_minor = 4;
  out.file_source_id = strip;
  out.evlr_offset = 0;
  out.evlr_count = 0;
  out.point_format |= kLazFlag;
  out.header_size = kLasHeaderSize14;
  out.vlr_count = static_cast<std::uint32_t>(config_.records.size() + 1);
  out.point_offset = static_cast<std::uint32_t>(kLasHeaderSize14 + vlrs_.size());
  out.minimum = tally.minimum;
  out.maximum = tally.maximum;
  out.point_count = tally.points;
  out.points_by_return = tally.by_return;
  return out;
}

/// Writes a chunk in the place of one that was not full, and with it what makes the file whole: table and header.
Status CloudParts::write_chunk(Part& part, const Packed& packed, bool is_full) {
  const std::uint16_t strip = strip_of(part);
  const bool is_new = part.path.empty();
  if (is_new) {
    const std::string name = is_strips() ? fmt::format("strip_{:05}", strip) : name_of(part);
    part.path = folder_ / (name + config_.ending + kUnfinished);
  }
  auto file = FileWriter::create(part.path, IfExists::Continue, *config_.disk);
  if (!file) {
    if (is_new) part.path.clear();
    return fail(file.error());
  }
  Tally tally = part.whole;
  tally.add(packed.tally);
  std::vector<LazChunkSize> chunks = part.chunks;
  chunks.push_back({packed.bytes.size(), static_cast<std::uint32_t>(packed.tally.points)});
  const LasHeader header = header_of(tally, strip);
  const std::uint64_t begin = is_new ? header.point_offset + sizeof(std::uint64_t) : part.whole_bytes;
  const std::uint64_t table_at = begin + packed.bytes.size();
  const Bytes head = encode_las_header(header), table = encode_laz_table(chunks, false);
  const ByteView place = std::as_bytes(std::span(&table_at, 1));
  const auto write = [&]() -> Status {
    if (Status cut = file->cut_back(part.whole_bytes); !cut) return cut;
    if (is_new) {
      const ByteView pieces[] = {head, vlrs_, place, packed.bytes, table};
      return file->write(pieces);
    }
    const ByteView pieces[] = {packed.bytes, table};
    if (Status written = file->write(pieces); !written) return written;
    if (Status written = file->overwrite(header.point_offset, place); !written) return written;
    return file->overwrite(0, head);
  };
  if (Status written = write(); !written) {
    (void)fail(written.error());
    // What is in full chunks stays readable.
    part.tail = {};
    part.bytes = 0;
    if (part.chunks.empty()) {
      (void)file->close_without_waiting();
      (void)config_.disk->remove(part.path);
      part.path.clear();
    } else if (file->cut_back(part.whole_bytes)) {
      // The table comes last: without it the chunks are found one after another.
      if (file->overwrite(0, encode_las_header(header_of(part.whole, strip))) &&
          file->overwrite(header.point_offset, std::as_bytes(std::span(&part.whole_bytes, 1))))
        (void)file->write(encode_laz_table(part.chunks, false));
      part.bytes = file->size();
    }
    return *error_;
  }
  part.bytes = file->size();
  if (is_full) {
    part.whole = tally;
    part.tail = {};
    part.chunks = std::move(chunks);
    part.whole_bytes = table_at;
    part.tail_bytes = 0;
  } else {
    part.tail = packed.tally;
    part.whole_bytes = begin;
    part.tail_bytes = packed.bytes.size();
  }
  if (Status closed = file->close_without_waiting(); !closed) return fail(closed.error());
  return {};
}

std::string CloudParts::name_of(const Part& part) const {
  if (!is_strips()) {
    const auto corner = [&](std::int64_t cell) {
      return fmt::format("{:.10g}", static_cast<double>(cell) * config_.tile_edge);
    };
    return fmt::format("tile_{}_{}_{:g}m", corner(part.cell.first), corner(part.cell.second), config_.split.size);
  }
  Tally tally = part.whole;
  tally.add(part.tail);
  const UtcTime utc = to_utc(from_las_time(tally.first_time));
  return fmt::format("strip_{:05}_{:04}{:02}{:02}T{:02}{:02}{:02}Z", strip_of(part), utc.year, utc.month, utc.day,
                     utc.hour, utc.minute, utc.second);
}

/// Gives a whole file its name.
Status CloudParts::name_file(Part& part) {
  CloudPart done;
  done.file = name_of(part) + config_.ending;
  const std::filesystem::path whole = folder_ / done.file;
  if (Status allowed = check_output(whole); !allowed) return allowed;
  std::error_code error;
  std::filesystem::rename(part.path, whole, error);
  if (error) return output_error("rename " + part.path.string() + " to " + done.file.string(), error.value());
  Tally tally = part.whole;
  tally.add(part.tail);
  done.strip = strip_of(part);
  done.points = tally.points;
  done.bytes = part.bytes;
  done.minimum = tally.minimum;
  done.maximum = tally.maximum;
  if (form_.time_at() != 0 && (config_.header.global_encoding & kLasAdjustedTime) != 0) {
    done.first = from_las_time(tally.first_time);
    done.last = from_las_time(tally.last_time);
  }
  done_.push_back(std::move(done));
  return {};
}

Status CloudParts::finish() {
  fix_base();
  for (auto& [cell, part] : parts_)
    if (!error_) (void)submit(*part, true);  // its error is remembered
  (void)write_underway();
  for (auto& [cell, part] : parts_)
    if (!part->path.empty())
      if (Status named = name_file(*part); !named) (void)fail(named.error());
  parts_.clear();
  latest_ = nullptr;
  free_.clear();
  std::sort(done_.begin(), done_.end(), [](const CloudPart& a, const CloudPart& b) { return a.file < b.file; });
  if (const int result = config_.disk->sync_all(folder_); result != 0)
    (void)fail(output_error("sync " + folder_.string(), -result));
  return error_ ? Status(*error_) : Status();
}

Result<std::size_t> remove_parts(const std::filesystem::path& folder, EarlierParts which) {
  std::error_code error;
  std::vector<std::filesystem::path> found;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::string name = at->path().filename().string();
    const bool is_growing = name.ends_with(kUnfinished);
    if (is_growing) name.resize(name.size() - std::strlen(kUnfinished));
    const bool is_part = (name.starts_with("strip_") || name.starts_with("tile_")) && name.ends_with(".laz") &&
                         !name.ends_with(".copc.laz");
    const bool is_unfinished = is_part && (is_growing || name.ends_with(kBeforeOctree));
    if (is_unfinished || (which == EarlierParts::All && (is_part || name == kPartIndex))) found.push_back(at->path());
  }
  if (error == std::errc::no_such_file_or_directory) return std::size_t{0};
  if (error) return io_error("read the folder " + folder.string(), error.value());
  std::size_t removed = 0;
  for (const std::filesystem::path& path : found) {
    removed += std::filesystem::remove(path, error) ? 1 : 0;
    if (error) return io_error("remove " + path.string(), error.value());
  }
  return removed;
}

}  // namespace hueline::storage
