#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "core/line_words.hpp"

/// Fits the trees of fusion/sight_trees.hpp to tables of `hueline score --sights`, and prints that file. On the error
/// stream: how well the trees tell what the lenses saw, and for each table how well trees of the other tables do.
///
/// The method is gradient boosting of the logistic loss (Friedman, Annals of Statistics 29, 2001) with trees that ask
/// one question a level of all their leaves alike (Kohavi and Li, IJCAI 1995). The same tables give the same trees.
namespace {

constexpr std::size_t kTrees = 80, kQuestions = 5, kAnswers = 1U << kQuestions;
constexpr double kRate = 0.4, kLeast = 12.0;  // share of a step that is taken; weight that a side of a question needs
constexpr std::size_t kBins = 64;             // of each evidence, with as many lines each

struct Table {
  std::string name;
  std::size_t width = 0;  // evidences of a line
  std::vector<std::uint8_t> is_seen;
  std::vector<float> evidence;  // of each line, one after another
};

struct Tree {
  std::array<std::size_t, kQuestions> about{};
  std::array<std::size_t, kQuestions> least{};  // bin
  std::array<double, kAnswers> values{};
};

/// The bounds between the bins of each evidence.
using Bins = std::vector<std::vector<float>>;

bool read(const std::string& file, std::vector<std::string>& words, Table& out) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line)) return false;
  const auto columns = hueline::line_words(line, ",");
  if (columns.size() < 3 || columns[0] != "point" || columns[1] != "seen") return false;
  words.assign(columns.begin() + 2, columns.end());
  out.name = file;
  out.width = words.size();
  while (std::getline(in, line)) {
    const char* at = line.data();
    char* end = nullptr;
    std::strtod(at, &end);  // the point
    if (*end != ',') return false;
    at = end + 1;
    out.is_seen.push_back(std::strtod(at, &end) != 0 ? 1 : 0);
    for (std::size_t k = 0; k < out.width; ++k) {
      if (*end != ',') return false;
      at = end + 1;
      out.evidence.push_back(std::strtof(at, &end));
    }
  }
  return true;
}

Bins make_bins(const std::vector<const Table*>& tables) {
  Bins bins;
  for (std::size_t k = 0; k < tables.front()->width; ++k) {
    std::vector<float> values;
    for (const Table* table : tables)
      for (std::size_t i = k; i < table->evidence.size(); i += table->width) values.push_back(table->evidence[i]);
    std::sort(values.begin(), values.end());
    std::vector<float> bounds;
    for (std::size_t b = 1; b < kBins && !values.empty(); ++b)
      if (const float bound = values[values.size() * b / kBins]; bounds.empty() || bound > bounds.back())
        bounds.push_back(bound);
    bins.push_back(std::move(bounds));
  }
  return bins;
}

/// Lines of tables with the bins of their evidences.
struct Lines {
  Lines(const std::vector<const Table*>& tables, const Bins& bins) : width(bins.size()) {
    for (const Table* table : tables) {
      is_seen.insert(is_seen.end(), table->is_seen.begin(), table->is_seen.end());
      for (std::size_t i = 0; i < table->evidence.size(); ++i) {
        const std::vector<float>& bounds = bins[i % width];
        bin.push_back(static_cast<std::uint8_t>(std::upper_bound(bounds.begin(), bounds.end(), table->evidence[i]) -
                                                bounds.begin()));
      }
    }
  }
  std::size_t answer(std::size_t line, const Tree& tree, std::size_t questions) const {
    std::size_t out = 0;
    for (std::size_t q = 0; q < questions; ++q)
      out = 2 * out + (bin[line * width + tree.about[q]] >= tree.least[q] ? 1U : 0U);
    return out;
  }
  std::size_t width;
  std::vector<std::uint8_t> is_seen, bin;
};

/// The sums of the loss's first and second derivative.
struct Slope {
  double first = 0, second = 0;
  Slope& operator+=(const Slope& other) {
    first += other.first;
    second += other.second;
    return *this;
  }
  Slope operator-(const Slope& other) const { return {first - other.first, second - other.second}; }
  double gain() const { return first * first / (second + 1); }
};

std::vector<Tree> fit(const Lines& lines) {
  std::vector<Tree> trees;
  const std::size_t count = lines.is_seen.size(), cells = lines.width * kBins;
  std::vector<double> odds(count, 0);
  std::vector<Slope> slopes(count);
  for (std::size_t t = 0; t < kTrees; ++t) {
    for (std::size_t i = 0; i < count; ++i) {
      const double p = 1 / (1 + std::exp(-odds[i]));
      slopes[i] = {lines.is_seen[i] - p, p * (1 - p)};
    }
    Tree& tree = trees.emplace_back();
    for (std::size_t q = 0; q < kQuestions; ++q) {
      std::vector<Slope> sums((std::size_t{1} << q) * cells);
      for (std::size_t i = 0; i < count; ++i) {
        Slope* const of = &sums[lines.answer(i, tree, q) * cells];
        for (std::size_t k = 0; k < lines.width; ++k) of[k * kBins + lines.bin[i * lines.width + k]] += slopes[i];
      }
      double best = -1;
      for (std::size_t k = 0; k < lines.width; ++k)
        for (std::size_t least = 1; least < kBins; ++least) {
          double gain = 0;
          for (std::size_t a = 0; a < std::size_t{1} << q; ++a) {
            const Slope* const of = &sums[a * cells + k * kBins];
            Slope all, below;
            for (std::size_t b = 0; b < kBins; ++b) {
              all += of[b];
              if (b < least) below += of[b];
            }
            const Slope above = all - below;
            if (below.second >= kLeast && above.second >= kLeast) gain += below.gain() + above.gain() - all.gain();
          }
          if (gain <= best) continue;
          best = gain;
          tree.about[q] = k;
          tree.least[q] = least;
        }
    }
    std::array<Slope, kAnswers> leaves{};
    for (std::size_t i = 0; i < count; ++i) leaves[lines.answer(i, tree, kQuestions)] += slopes[i];
    for (std::size_t a = 0; a < kAnswers; ++a) tree.values[a] = kRate * leaves[a].first / (leaves[a].second + 1);
    for (std::size_t i = 0; i < count; ++i) odds[i] += tree.values[lines.answer(i, tree, kQuestions)];
  }
  return trees;
}

/// Says how well the trees tell what was seen: the mean loss against that of the mean alone.
void judge(const std::string& name, const std::vector<Tree>& trees, const Lines& lines) {
  double loss = 0, seen = 0;
  std::size_t right = 0, given = 0;
  for (std::size_t i = 0; i < lines.is_seen.size(); ++i) {
    double odds = 0;
    for (const Tree& tree : trees) odds += tree.values[lines.answer(i, tree, kQuestions)];
    const bool is_seen = lines.is_seen[i] != 0;
    loss += std::log1p(std::exp(is_seen ? -odds : odds));
    seen += is_seen ? 1 : 0;
    given += odds >= 1 ? 1 : 0;
    right += odds >= 1 && is_seen ? 1 : 0;
  }
  const double count = static_cast<double>(lines.is_seen.size()), mean = seen / count;
  const double plain = -(mean * std::log(mean) + (1 - mean) * std::log1p(-mean));
  fmt::print(stderr,
             "{}: {} lines, {:.1f} % free; loss {:.3f} of {:.3f}; of those with log-odds of 1 {:.2f} % are free\n",
             name, lines.is_seen.size(), 100 * mean, loss / count, plain,
             100 * static_cast<double>(right) / std::max(1.0, static_cast<double>(given)));
}

void print(const std::vector<Tree>& trees, const Bins& bins, const std::vector<std::string>& words) {
  fmt::print(
      "#pragma once\n\n#include <array>\n\n#include \"fusion/sight_judge.hpp\"\n\n"
      "/// What simulated drives taught about lines of sight. This file is written by score/fit_sights.cpp\n"
      "/// (docs/methods/visibility.md).\n"
      "namespace hueline::fusion {{\n\ninline constexpr std::array<SightTree, {}> kSightTrees{{{{\n",
      trees.size());
  for (const Tree& tree : trees) {
    std::string questions, values;
    for (std::size_t q = 0; q < kQuestions; ++q)
      questions += fmt::format("{}{{Evidence::{}, {:#.6g}f}}", q > 0 ? ", " : "", words[tree.about[q]],
                               bins[tree.about[q]].at(tree.least[q] - 1));
    for (std::size_t a = 0; a < kAnswers; ++a) values += fmt::format("{}{:.5f}f", a > 0 ? ", " : "", tree.values[a]);
    fmt::print("    {{{{{{{}}}}},\n     {{{{{}}}}}}},\n", questions, values);
  }
  fmt::print("}}}};\n\n}}  // namespace hueline::fusion\n");
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Table> tables;
  std::vector<std::string> words, first;
  for (int i = 1; i < argc; ++i)
    if (!read(argv[i], words, tables.emplace_back()) || (i > 1 && words != first)) {
      fmt::print(stderr,
                 "{}: not a table of lines of sight as hueline score --sights writes them, or of other columns\n",
                 argv[i]);
      return 3;
    } else {
      first = words;
    }
  if (tables.size() < 2) {
    fmt::print(stderr, "usage: fit_sights TABLE TABLE [TABLE...] >fusion/sight_trees.hpp\n");
    return 2;
  }
  std::vector<const Table*> all;
  for (const Table& table : tables) all.push_back(&table);
  const Bins bins = make_bins(all);
  for (const Table& table : tables) {
    std::vector<const Table*> others;
    std::copy_if(all.begin(), all.end(), std::back_inserter(others),
                 [&](const Table* other) { return other != &table; });
    judge(table.name + " by the others", fit(Lines(others, bins)), Lines({&table}, bins));
  }
  const Lines lines(all, bins);
  const std::vector<Tree> trees = fit(lines);
  judge("all", trees, lines);
  print(trees, bins, words);
}
