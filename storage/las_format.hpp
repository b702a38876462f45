#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/calendar.hpp"
#include "core/result.hpp"
#include "storage/byte_order.hpp"

/// The parts of a LAS file (ASPRS LAS 1.4 R15): public header, variable length records, point records.
namespace hueline::storage {

/// GPS time minus this number of seconds is "adjusted standard GPS time".
constexpr std::int64_t kAdjustedGpsSeconds = 1'000'000'000;
constexpr std::size_t kLasHeaderSize14 = 375;
constexpr std::size_t kLasVlrHead = 54;
constexpr std::size_t kLasEvlrHead = 60;                              ///< of an extended record
constexpr std::size_t kLasExtraDescription = 192;                     ///< of one field in the Extra Bytes record
constexpr std::uint8_t kLasFormatBits = 0x3F;                         ///< of the point format; the others say LAZ
constexpr std::uint16_t kLasAdjustedTime = 1 << 0, kLasWkt = 1 << 4;  // bits of the global encoding

/// The generating software in the header of a file that its writer has not closed.
constexpr const char* kLasUnfinished = "hueline: not finished";

/// A variable length record.
struct LasVlr {
  std::string user_id;
  std::uint16_t record_id = 0;
  std::string description;
  std::string data;
};

/// The public header. Numbers are in the units of the file.
struct LasHeader {
  int version_minor = 4;
  std::uint16_t file_source_id = 0;  ///< number of the strip (flight line); 0: the file is no strip
  std::uint16_t global_encoding = 0;
  std::string system_identifier, generating_software;
  int creation_year = 0, creation_day = 0;
  std::uint32_t header_size = 0, point_offset = 0, vlr_count = 0;
  std::uint8_t point_format = 0;
  std::uint16_t point_size = 0;
  std::array<double, 3> scale{1, 1, 1}, offset{}, minimum{}, maximum{};
  std::uint64_t point_count = 0;
  std::array<std::uint64_t, 15> points_by_return{};
  std::uint64_t evlr_offset = 0;  ///< where the first extended record begins, behind the points; 0: there is none
  std::uint32_t evlr_count = 0;
};

/// Returns the 375 bytes of a header of version 1.4. The point counts of older versions are 0 for the point formats 6
/// and above, and where they are too small for the count.
Bytes encode_las_header(const LasHeader& header);
/// Reads a header of version 1.0 to 1.4. Errors: Malformed if this is no LAS header; Unsupported for another version.
Result<LasHeader> decode_las_header(ByteView bytes);

/// Appends a variable length record: 54 bytes of head, then its data.
void append_vlr(Bytes& out, const LasVlr& vlr);
/// Appends the 60 bytes of head of an extended variable length record with `size` bytes of data.
void append_evlr_head(Bytes& out, const std::string& user_id, std::uint16_t record_id, const std::string& description,
                      std::uint64_t size);

/// Types of extra bytes, with their numbers in the file.
enum class LasType : std::uint8_t { U8 = 1, I8, U16, I16, U32, I32, U64, I64, F32, F64 };
std::size_t size_of(LasType type);

/// One field of the Extra Bytes record (user id LASF_Spec, record id 4).
struct LasExtraField {
  std::string name, description;
  LasType type = LasType::U8;
  std::size_t offset = 0;  ///< byte in the point record
  bool has_scale = false;
  double scale = 1, shift = 0;  ///< value = stored * scale + shift if has_scale is set
};
/// Returns the data of the record. The offsets are not part of it.
std::string encode_extra_fields(const std::vector<LasExtraField>& fields);
/// Reads the record; of several, give their data one after the other. An array of two or three values becomes as many
/// fields, NAME[0] and so on. "Undocumented bytes" are left out of the result; they only move the offset of the fields
/// behind them. A field of a reserved type ends the list, because its size is unknown.
std::vector<LasExtraField> decode_extra_fields(ByteView data, std::size_t first_offset);

/// Returns the number of bytes of a point format (0 to 10) without extra bytes; 0 if there is no such format.
std::size_t las_point_size(int format);

/// Returns adjusted standard GPS time in seconds.
double to_las_time(GpsTime time);
/// Returns the GPS time of adjusted standard GPS time in seconds.
GpsTime from_las_time(double adjusted_seconds);

}  // namespace hueline::storage
