#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>

#include "apps/calibrate/calibrate.hpp"
#include "apps/exit_code.hpp"
#include "apps/input_error.hpp"
#include "apps/log.hpp"
#include "calibration/lens/lens_report.hpp"
#include "calibration/lens/opencv_reference.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {
namespace {

using namespace calibration;

// The time that OpenCV takes grows with the cube of the number of views: 1 s for 60, 17 s for 157, minutes for 400.
constexpr std::size_t kMostReferenceViews = 60;
constexpr double kUsualSigma_px = 1.0;  // Usual sigma of a corner's coordinate. A larger one is not caused by the lens.

struct CalibrateLensOptions {
  std::vector<std::string> images;
  std::string board = "chessboard", size, model = "auto", out, dictionary;
  double spacing_m = 0.03, marker_m = 0.02;
  bool one_focal = false;
  std::string date;
};

/// The words of --board.
constexpr std::array<std::pair<const char*, BoardKind>, 5> kBoards{
    {{"chessboard", BoardKind::Chessboard},
     {"circles", BoardKind::Circles},
     {"asymmetric_circles", BoardKind::AsymmetricCircles},
     {"charuco", BoardKind::Charuco},
     {"aprilgrid", BoardKind::AprilGrid}}};

Board board_of(const CalibrateLensOptions& options) {
  Board board;
  for (const auto& [word, kind] : kBoards)
    if (options.board == word) board.kind = kind;
  int read = 0;
  if (std::sscanf(options.size.c_str(), "%dx%d%n", &board.columns, &board.rows, &read) != 2 ||
      static_cast<std::size_t>(read) != options.size.size())
    throw config::ConfigError(fmt::format("--size is '{}'; allowed: columns x rows, 9x6", options.size));
  board.spacing_m = options.spacing_m;
  board.marker_m = options.marker_m;
  board.dictionary = !options.dictionary.empty()          ? options.dictionary
                     : board.kind == BoardKind::AprilGrid ? "DICT_APRILTAG_36h11"
                                                          : "DICT_4X4_50";
  if (const std::string wrong = board.validate(); !wrong.empty()) throw config::ConfigError(wrong);
  return board;
}

/// Returns the files as named. A folder stands for its images in the order of their names.
std::vector<std::filesystem::path> images_of(const std::vector<std::string>& named) {
  std::vector<std::filesystem::path> out;
  for (const std::string& one : named) {
    if (!std::filesystem::exists(one)) throw InputError("open " + one + ": is not there");
    if (!std::filesystem::is_directory(one)) {
      out.emplace_back(one);
      continue;
    }
    std::vector<std::filesystem::path> inside;
    for (const auto& entry : std::filesystem::directory_iterator(one)) {
      std::string kind = entry.path().extension().string();
      std::transform(kind.begin(), kind.end(), kind.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (kind == ".jpg" || kind == ".jpeg" || kind == ".png" || kind == ".tif" || kind == ".tiff" || kind == ".bmp")
        inside.push_back(entry.path());
    }
    std::sort(inside.begin(), inside.end());
    out.insert(out.end(), inside.begin(), inside.end());
  }
  return out;
}

std::string reference_text(const OpencvLens& reference, bool is_bent) {
  if (!reference.failure.empty()) return "OpenCV finds no lens from the same corners: " + reference.failure;
  std::string out =
      fmt::format("OpenCV on the same corners{}: focal {:.3f} {:.3f}, principal point {:.3f} {:.3f}, distortion",
                  is_bent ? " of a plane board" : "", reference.lens.focal_px.x(), reference.lens.focal_px.y(),
                  reference.lens.principal_point_px.x(), reference.lens.principal_point_px.y());
  for (const double k : reference.lens.distortion) out += fmt::format(" {:.5f}", k);
  return out + fmt::format(", rms {:.4f} px", reference.rms_px);
}

void print(const LensCalibration& found, const LensReportContext& context) {
  const AdjustedLens& adjusted = found.adjusted;
  std::string out = fmt::format(
      "{}\n{}  rms {:.4f} px over {} corners in {} views, sigma of a coordinate {:.4f} px; the views disagree {:.1f} "
      "times as much as by that\n",
      context.data, name(adjusted.lens.model), adjusted.rms_px, adjusted.observations / 2, found.views.size(),
      adjusted.sigma_px, adjusted.disagreement);
  const auto names = parameter_names(adjusted.lens.model);
  const auto values = adjusted.lens.parameters();
  for (int i = 0; i < parameter_count(adjusted.lens.model); ++i)
    out += fmt::format("  {:16}{:14.6f} +- {:.6f}\n", names[static_cast<std::size_t>(i)],
                       values[static_cast<std::size_t>(i)], std::sqrt(adjusted.covariance(i, i)));
  if (found.is_bent())
    out += fmt::format(
        "  the board is not plane: its corners are spread over {:.2g} mm across its best plane. Its bend was adjusted "
        "together "
        "with the lens; a stiffer board gives smaller sigmas\n",
        found.board.bend_height() * 1e3);
  for (const ModelTrial& trial : found.trials) out += fmt::format("  {:16}{}\n", name(trial.model), trial.words());
  out += context.reference + "\n";
  for (const auto& text : context.unseen) out += "left out: " + text + "\n";
  for (const auto& view : found.rejected_views) out += fmt::format("left out: {}: {}\n", view.view, view.why);
  for (const auto& corner : found.rejected_corners)
    out += fmt::format("left out: {}: corner {} is {:.2f} px off\n", corner.view, corner.index, corner.error_px);
  std::fputs(out.c_str(), stdout);
}

using Size = std::pair<std::uint32_t, std::uint32_t>;  // width and height, px

/// The views of the board in images of one size.
struct SeenBoards {
  Size size;
  std::vector<BoardView> views;     ///< empty if no image shows the board
  std::vector<std::string> unseen;  ///< images that are left out, and why
  std::size_t turned = 0;           ///< images with the board that their EXIF data turn before they are shown
};

/// Finds the board in the images. All images of a lens have one size. The size used is the one in which the board was
/// found most often, because the first image may be a picture of the setup.
SeenBoards find_boards(const std::vector<std::filesystem::path>& images, const Board& board) {
  SeenBoards out;
  std::map<Size, std::vector<BoardView>> by_size;
  for (const auto& path : images) {
    const auto image = read_grey_image(path.string());
    if (!image.ok()) {
      out.unseen.push_back(image.error().message);
      continue;
    }
    auto corners = find_board(*image, board);
    if (!corners.ok()) {
      out.unseen.push_back(path.filename().string() + ": " + corners.error().message);
      continue;
    }
    out.turned += image->orientation != 1;
    auto& views = by_size[{static_cast<std::uint32_t>(image->width), static_cast<std::uint32_t>(image->height)}];
    // A copy would count as a view of its own and make the sigmas too small.
    if (const auto same = std::ranges::find(views, *corners, &BoardView::corners); same != views.end())
      out.unseen.push_back(fmt::format("{}: the same picture as {}", path.filename().string(), same->name));
    else
      views.push_back({path.filename().string(), std::move(*corners)});
  }
  const auto most = std::ranges::max_element(by_size, {}, [](const auto& one) { return one.second.size(); });
  if (most == by_size.end()) return out;
  out.size = most->first;
  out.views = most->second;
  for (const auto& [size, seen] : by_size)
    if (size != out.size)
      for (const BoardView& view : seen)
        out.unseen.push_back(fmt::format(
            "{}: {} x {} px, most views have {} x {}{}", view.name, size.first, size.second, out.size.first,
            out.size.second,
            size == Size{out.size.second, out.size.first} ? ": another program has turned it by a quarter" : ""));
  return out;
}

/// Writes lens.yaml, lens.json and lens.html into the folder, and prints their names.
Status write_reports(const std::filesystem::path& out, const LensCalibration& found, const LensReportContext& context) {
  const auto folder = OutputFolder::open(out);
  if (!folder.ok()) return folder.error();
  for (const auto& [file, text] :
       {std::pair{"lens.yaml", "lens:\n" + lens_fragment(found, context, 2)},
        std::pair{"lens.json", lens_json(found, context)}, std::pair{"lens.html", lens_html(found, context)}}) {
    if (const Status written = write_output(out / file, text); !written.ok()) return written;
    std::fputs(((out / file).string() + "\n").c_str(), stdout);
  }
  return {};
}

/// Returns what users may have meant where no image shows `board`: the squares of a chessboard counted instead of its
/// inner corners, columns and rows exchanged, or the other grid of circles. Empty: nothing of it shows in the first
/// images either.
std::string board_meant(const std::vector<std::filesystem::path>& images, const Board& board) {
  std::vector<std::pair<Board, std::string>> others;
  const auto add = [&](BoardKind kind, int columns, int rows, const std::string& what) {
    Board other = board;
    other.kind = kind, other.columns = columns, other.rows = rows;
    if (other.validate().empty()) others.emplace_back(other, fmt::format(fmt::runtime(what), columns, rows));
  };
  const int columns = board.columns, rows = board.rows;
  if (board.kind == BoardKind::Chessboard)
    add(board.kind, columns - 1, rows - 1, "a chessboard of {0} x {1} inner corners: --size {0}x{1}");
  if (board.kind == BoardKind::AsymmetricCircles) {
    add(board.kind, rows, columns, "a grid of {0} circles in each of {1} rows: --size {0}x{1}");
    add(BoardKind::Circles, columns, rows, "{} x {} circles in straight rows and columns: --board circles");
  }
  if (board.kind == BoardKind::Circles)
    add(BoardKind::AsymmetricCircles, columns, rows,
        "rows of {} circles of which every other one is shifted: --board asymmetric_circles");
  constexpr std::size_t kTried = 3;
  for (std::size_t i = 0; i < std::min(kTried, images.size()); ++i) {
    const auto image = read_grey_image(images[i].string());
    if (!image.ok()) continue;
    for (const auto& [other, what] : others)
      if (find_board(*image, other).ok()) return fmt::format("{} shows {}", images[i].filename().string(), what);
  }
  return {};
}

int run(const CalibrateLensOptions& options) {
  const Board board = board_of(options);
  const auto images = images_of(options.images);
  LensReportContext context;
  context.date = options.date.empty() ? today() : options.date;
  const SeenBoards seen = find_boards(images, board);
  context.unseen = seen.unseen;
  if (seen.views.empty()) {
    for (const auto& text : context.unseen) log_warning("left out: {}", text);
    const std::string meant = board_meant(images, board);
    log_error("none of {} images shows the board: {}", images.size(),
              !meant.empty()                        ? meant
              : board.kind == BoardKind::Chessboard ? "is --size right (inner corners, not squares)?"
                                                    : "is --size right (as the board's maker counts it)?");
    return kInputUnreadable;
  }
  LensCalibrationConfig config;
  if (options.model != "auto") config.model = options.model == "brown" ? LensModel::Brown : LensModel::KannalaBrandt;
  config.one_focal = options.one_focal;
  const auto found = calibrate_lens(board, seen.views, seen.size.first, seen.size.second, config);
  if (!found.ok()) {
    for (const auto& text : context.unseen) log_warning("left out: {}", text);
    log_error(found.error().message);
    return kInputUnreadable;
  }
  context.data = fmt::format("{} of {} images, {} {} of {} m", found->views.size(), images.size(), options.board,
                             options.size, options.spacing_m);
  if (found->is_bent()) context.data += fmt::format(", which is bent by {:.2g} mm", found->board.bend_height() * 1e3);
  context.reference =
      found->views.size() > kMostReferenceViews
          ? fmt::format("OpenCV was not run for comparison: it would take too long for more than {} views",
                        kMostReferenceViews)
          : reference_text(calibrate_with_opencv(*found, options.one_focal), found->is_bent());
  print(*found, context);
  if (seen.turned > 0)
    std::fputs(fmt::format("{} images are to be shown turned by their EXIF data: the lens is that of the images as "
                           "stored, {} x {} px (hueline colour: --image-turn)\n",
                           seen.turned, seen.size.first, seen.size.second)
                   .c_str(),
               stdout);
  if (found->adjusted.sigma_px > kUsualSigma_px)
    log_warning(
        "the corners differ from the best lens by {:.1f} px (one sigma), and with good images by 0.1 to 0.5 px: check "
        "that --size is that of the whole board, that the board is plane, and that the images are sharp",
        found->adjusted.sigma_px);
  constexpr double kUsualFocalSigma = 0.03;  // as a share
  const double focal = found->adjusted.lens.focal_px.x(), sigma = std::sqrt(found->adjusted.covariance(0, 0));
  if (sigma > kUsualFocalSigma * focal)
    log_warning(
        "the views hardly determine the focal length ({:.1f} px +- {:.1f}): tilt the board against the image, "
        "differently in each view",
        focal, sigma);
  if (found->two_lenses)
    log_warning("{}. The result is a mean of both: calibrate the images of each by themselves",
                found->two_lenses->words());
  if (options.out.empty()) return kDone;
  if (const Status written = write_reports(options.out, *found, context); !written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  return kDone;
}

}  // namespace

void add_calibrate_lens(Command& calibrate) {
  auto options = std::make_shared<CalibrateLensOptions>();
  Command command = calibrate.command(
      "lens",
      "find focal lengths, principal point and distortion of a lens, with their sigmas, from images of a board");
  command.required("IMAGES", options->images, "images of the board, or folders of them");
  std::vector<std::string> boards;
  for (const auto& [word, kind] : kBoards) boards.emplace_back(word);
  command.setting(
      "--board", options->board,
      "type of the board; circles are dark on a light ground; of asymmetric ones every other row is shifted", boards);
  command.option("--size", options->size,
                 "columns x rows: inner corners of a chessboard (9x6), circles (7x5), circles in a row x rows of an "
                 "asymmetric grid (4x11), squares of a ChArUco board, tags of an AprilGrid");
  command.setting(
      "--spacing-m", options->spacing_m,
      "edge of a square; circles: from centre to centre; asymmetric_circles: distance between two rows; aprilgrid: "
      "step from tag to tag, which is Kalibr's tagSize x (1 + tagSpacing)",
      {.least = 0.001, .most = 10});
  command.setting("--marker-m", options->marker_m, "charuco, aprilgrid: edge of a marker (Kalibr's tagSize)",
                  {.least = 0.001, .most = 10});
  command.setting(
      "--dictionary", options->dictionary,
      "name of OpenCV's marker dictionary; default: DICT_4X4_50 of charuco, DICT_APRILTAG_36h11 of aprilgrid",
      marker_dictionaries());
  command.setting("--model", options->model,
                  "auto selects the model that best predicts views to which it was not fitted",
                  {"auto", "brown", "kannala_brandt"});
  command.flag("--one-focal", options->one_focal, "one focal length for both axes (square pixels)");
  command.option("--date", options->date, "date of the result, YYYY-MM-DD; default: today");
  command.option("--out", options->out,
                 "folder for lens.yaml (for the rig file or hueline colour), lens.json and lens.html");
  command.reads(options->images).writes_into(options->out);
  command.footer(
      "Example: hueline calibrate lens views --board chessboard --size 9x6 --spacing-m 0.03 --out lens\n"
      "Exit status: 0; 3 if an image cannot be read; 5 if no board was found.\n"
      "More: docs/calibration.md");
  command.runs([options] { return run(*options); });
}

}  // namespace hueline::apps
