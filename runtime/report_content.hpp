#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/rig.hpp"
#include "runtime/drive_map.hpp"
#include "runtime/summary.hpp"
#include "runtime/verdict.hpp"

namespace hueline::runtime {

/// The map in pixels of a picture of kWidth x kHeight from its upper left corner; north is up.
struct ReportMap {
  struct Place {
    double x = 0, y = 0;
  };
  /// The classes of the map's lines, the gravest last.
  enum class Line { Driven, Coloured, Colourless, Empty };
  static constexpr double kWidth = 720, kHeight = 380, kBorder = 24;
  struct Path {
    Line line = Line::Driven;
    std::vector<Place> places;
  };
  struct Label {
    Place at;
    std::size_t number = 0;
  };
  double px_per_m = 1;
  std::vector<Path> paths;
  std::vector<Place> weak;     ///< where GNSS or pose were weak
  std::vector<Label> remarks;  ///< where they began; the number is that in the list of the reasons, from 1 on
  std::vector<Label> marks;
};

/// What the report of a drive says: the verdict with its reasons, the map (driven, coloured, without points, weak GNSS,
/// places to drive again), the operator's marks and the figures of coverage, colour, time, trajectory and losses.
/// report.html and report.pdf are made of it, so they cannot say different things.
struct ReportContent {
  using Map = ReportMap;
  using Line = ReportMap::Line;
  struct Reason {
    Grade grade = Grade::Remarks;
    std::string sensor, text;
    std::string when;  ///< " (time, duration, length, place)", or nothing for the whole drive
  };
  struct Mark {
    std::string label;  ///< "M1"
    std::string where;  ///< time, and place if it is known
    std::string note;
  };
  struct Figure {
    const char* what = "";
    std::string measured, wanted;
  };

  std::string rig;
  Grade grade = Grade::Good;
  std::optional<Map> map;       ///< nothing if no good solution came
  std::vector<Reason> reasons;  ///< all, the gravest first
  std::vector<Mark> marks;      ///< all
  std::vector<Figure> figures;

  /// How many report.html lists, so that it prints on a page.
  static constexpr std::size_t kReasons = 12, kMarks = 40;
};

// Sentences that both reports say.
constexpr const char* kNoMap = "There is no map: no good solution of the POS came.";
constexpr const char* kNoReason = "Nothing: nothing was missing while the vehicle moved.";
constexpr const char* kReasonsTitle = "What to drive again, and remarks";
constexpr const char* kMarksTitle = "Marks of the operator";

/// Returns the length of a scale's bar in metres, a round number, and its words ("200 m").
struct ScaleBar {
  double length_m = 1;
  std::string words;
};
ScaleBar scale_bar(double px_per_m, double most_px);

/// Judges nothing: `verdict` is what judge_drive() returned. The same input gives the same content.
ReportContent report_content(const config::Rig& rig, const Verdict& verdict, const Summary& summary,
                             const DriveMap& map);

/// Returns report.html: one page without any other file, which prints on a page of A4. The same content gives the same
/// bytes.
std::string report_html(const ReportContent& content);

/// Returns report.pdf: one page of A4, whatever the content. Of long lists it has what fits and says how many more
/// there are. The same content gives the same bytes.
std::string report_pdf(const ReportContent& content);

}  // namespace hueline::runtime
