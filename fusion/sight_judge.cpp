// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fusion/sight_judge.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "fusion/sight_judge.hpp"
#include "fusion/sight_trees.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::fusion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, SightTable::kMostLanes>;
using Whole = hn::RebindToSigned<D>;

/// Returns the values of the answers. A processor with 16 lanes has them in two registers.
inline hn::Vec<D> value_of(const SightTree& tree, hn::Vec<Whole> answer) {
  const D d;
  const Whole whole;
  if constexpr (hn::MaxLanes(D()) == 16) {
    static_assert(SightTree::kAnswers == 32);
    const auto within = hn::IndicesFromVec(d, hn::And(answer, hn::Set(whole, 15)));
    const auto low = hn::TableLookupLanes(hn::LoadU(d, tree.values.data()), within),
               high = hn::TableLookupLanes(hn::LoadU(d, tree.values.data() + 16), within);
    return hn::IfThenElse(hn::RebindMask(d, hn::Gt(answer, hn::Set(whole, 15))), high, low);
  } else {
    return hn::GatherIndex(d, tree.values.data(), answer);
  }
}

void log_odds(const SightTable& sights, float* out) {
  const D d;
  const Whole whole;
  std::array<const float*, kEvidences> columns;
  for (std::size_t k = 0; k < kEvidences; ++k) columns[k] = sights.column(k);
  for (std::size_t i = 0; i < sights.size(); i += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (const SightTree& tree : kSightTrees) {
      auto answer = hn::Zero(whole);
      for (std::size_t q = 0; q < SightTree::kQuestions; ++q) {
        const SightTree::Question& question = tree.questions[q];
        const auto known = hn::LoadU(d, columns[static_cast<std::size_t>(question.about)] + i);
        const auto is_so = hn::RebindMask(whole, hn::Ge(known, hn::Set(d, question.least)));
        const auto bit = hn::Set(whole, 1 << (SightTree::kQuestions - 1 - q));
        answer = hn::Or(answer, hn::IfThenElseZero(is_so, bit));
      }
      sum = hn::Add(sum, value_of(tree, answer));
    }
    hn::StoreU(sum, d, out + i);
  }
}

}  // namespace hueline::fusion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::fusion {
namespace {
HWY_EXPORT(log_odds);

std::size_t in_whole_vectors(std::size_t rows) {
  return (rows + SightTable::kMostLanes - 1) / SightTable::kMostLanes * SightTable::kMostLanes;
}
}  // namespace

std::size_t SightTable::add(const SightEvidence& evidence) {
  const std::size_t row = rows_++;
  if (columns_[0].size() < rows_)
    for (std::vector<float>& column : columns_) column.resize(in_whole_vectors(2 * rows_));
  for (std::size_t k = 0; k < kEvidences; ++k) columns_[k][row] = evidence[k];
  return row;
}

SightEvidence SightTable::operator[](std::size_t row) const {
  SightEvidence evidence;
  for (std::size_t k = 0; k < kEvidences; ++k) evidence[k] = columns_[k][row];
  return evidence;
}

void log_odds_of_sights(const SightTable& sights, std::vector<float>& out) {
  out.resize(in_whole_vectors(sights.size()));
  HWY_DYNAMIC_DISPATCH(log_odds)(sights, out.data());
  out.resize(sights.size());
}

}  // namespace hueline::fusion
#endif
