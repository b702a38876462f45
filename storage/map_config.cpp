#include "storage/map_config.hpp"

#include <algorithm>

namespace hueline::storage {
namespace {

bool is_number(const std::string& text) {
  return !text.empty() && text.size() <= 6 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}
bool is_code(const std::string& text) { return text.starts_with("EPSG:") && is_number(text.substr(5)); }
bool is_crs(const std::string& text) {
  const std::size_t plus = text.find('+');
  return text == "utm" ||
         (is_code(text.substr(0, plus)) && (plus == std::string::npos || is_number(text.substr(plus + 1))));
}

const TextForm kCrs{"utm, EPSG: and a number (EPSG:25832), or two numbers (EPSG:25832+7837)", is_crs,
                    "^(utm|EPSG:[0-9]{1,6}([+][0-9]{1,6})?)$"};
const TextForm kDatum{"EPSG: and the number of a geographic CRS (EPSG:4937)", is_code, "^EPSG:[0-9]{1,6}$"};

}  // namespace

void MapConfig::visit(Keys& keys) {
  keys.text(
      {"crs", "",
       "The map of `cloud.las`: the UTM zone of the drive's origin (near the poles UPS), or a projected coordinate "
       "reference system in "
       "metres, feet or US survey feet. With `+` and the number of a vertical one, or as a compound one, its heights "
       "are those of that system, in its unit; otherwise they are above the ellipsoid, in metres."},
      crs, kCrs);
  keys.text({"datum", "",
             "In which coordinate reference system the POS gives positions: that of the corrections it uses, or of its "
             "precise point positioning. EPSG:4937 is ETRS89, EPSG:6319 NAD83(2011), EPSG:7843 GDA2020, EPSG:7912 "
             "ITRF2014, EPSG:4979 WGS84.",
             "the map's own datum"},
            datum, kDatum);
  keys.number(
      {"epoch", "year",
       "At which epoch the positions are given, if the datum moves against the map's (2020.0). Corrections of a "
       "service have the service's epoch.",
       "0: the time of the drive"},
      epoch, {0, 2100});
  keys.number({"accuracy_m", "m",
               "How accurate an operation between datums must be, as its authority states it. A less accurate one is "
               "refused, also where a better one lacks only its grid on this computer."},
              accuracy_m, {0.001, 100});
  keys.text(
      {"geoid", "",
       "File of a grid of geoid heights above the ellipsoid of the map's datum (GTX, GeoTIFF), which are subtracted "
       "from the heights. For geoids that are not in PROJ's database.",
       "none"},
      geoid, kAnyText);
}

KeyError MapConfig::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (epoch != 0 && epoch < 1980) return not_allowed("epoch", number_text(epoch), "0, or a year from 1980 to 2100");
  if (!geoid.empty() && crs.find('+') != std::string::npos)
    return {"geoid", "is given beside a vertical system in crs; allowed: one of them"};
  return {};
}

}  // namespace hueline::storage
