#pragma once

#include <string>
#include <string_view>

namespace hueline::apps {

/// Says of a file that is a recording or a result of a known kind, but of one that is not read, what it is and what is
/// read instead: "is a solution of RTKLIB ...". It knows solutions of RTKLIB, RINEX, logs of NovAtel's receivers in
/// abbreviated ASCII and those of its OEM3, corrections (RTCM 3), Esri's grids in ASCII, traces of CARBUS Analyzer, and
/// images (JPEG, PNG, TIFF). Returns nothing for other first bytes. Sources: the heads that rtkpos of RTKLIB writes;
/// RINEX 2 and 3, column 61 of the first line; NovAtel, OEM6 Firmware Reference Manual, "Message Formats"; NovAtel,
/// MiLLennium GPSCard Command Descriptions Manual, appendix D (OEM3); RTCM 10403, transport layer; Esri, "Esri ASCII
/// raster format"; the heads that CARBUS Analyzer writes; TIFF 6.0, section 2; BigTIFF.
std::string foreign_file(std::string_view first_bytes);

}  // namespace hueline::apps
