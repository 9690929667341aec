#include "server/runtime/change_stream.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/base/checked_number.h"

namespace limber::server {
namespace {

// Frames that are compared and sent together.
constexpr int kBlock = 64;
// Ranges of a result besides those looked at. Gaps between more of them are sent along.
constexpr std::size_t kMostRanges = 4;

int block_count(int frames) { return (frames + kBlock - 1) / kBlock; }

FrameRange range_of_blocks(int first, int end, int frames) {
  return {first * kBlock, std::min(end * kBlock, frames) - first * kBlock};
}

int end_of(FrameRange range) { return range.first + range.count; }

/// Ranges in the order of their frames until there are at most `most`: the smallest gaps go first.
void join_nearest(std::vector<FrameRange>& ranges, std::size_t most) {
  while (ranges.size() > most) {
    std::size_t best = 1;
    for (std::size_t i = 1; i < ranges.size(); ++i) {
      const auto gap = [&](std::size_t at) { return ranges[at].first - end_of(ranges[at - 1]); };
      if (gap(i) < gap(best)) best = i;
    }
    ranges[best - 1].count = end_of(ranges[best]) - ranges[best - 1].first;
    ranges.erase(ranges.begin() + static_cast<std::ptrdiff_t>(best));
  }
}

}  // namespace

/// By blocks of frames: the largest change of a coordinate; 0 where there is none to speak of.
struct ChangeStream::Changes {
  std::vector<float> of_block;
  int frames = 0;

  /// Runs of changed blocks that `takes` accepts.
  template <class Takes>
  [[nodiscard]] std::vector<FrameRange> ranges(const Takes& takes) const {
    std::vector<FrameRange> found;
    const int blocks = static_cast<int>(of_block.size());
    const auto is_taken = [&](int block) {
      return of_block[static_cast<std::size_t>(block)] > 0 && takes(block);
    };
    for (int first = 0; first < blocks;) {
      int end = first;
      while (end < blocks && is_taken(end)) ++end;
      if (end > first) found.push_back(range_of_blocks(first, end, frames));
      first = end + 1;
    }
    return found;
  }
  [[nodiscard]] float largest(FrameRange range) const {
    const auto first = of_block.begin() + range.first / kBlock;
    return *std::max_element(first, first + block_count(range.count));
  }
};

ChangeStream::Changes ChangeStream::compare(const FrameSource& result) const {
  const Eigen::MatrixXf& now = *result.coordinates();
  Changes changes;
  changes.frames = static_cast<int>(now.cols());
  changes.of_block.assign(static_cast<std::size_t>(block_count(changes.frames)), 0);
  const float spacing = std::numeric_limits<float>::epsilon() * now.cwiseAbs().maxCoeff();
  for (std::size_t block = 0; block < changes.of_block.size(); ++block) {
    const FrameRange range =
        range_of_blocks(static_cast<int>(block), static_cast<int>(block) + 1, changes.frames);
    const float change =
        (now.middleCols(range.first, range.count) - sent_.middleCols(range.first, range.count))
            .cwiseAbs()
            .maxCoeff();
    if (!(change <= spacing)) changes.of_block[block] = change;
  }
  for (const FrameRange& range : early_) {
    for (int block = range.first / kBlock; block * kBlock < end_of(range); ++block) {
      float& change = changes.of_block[static_cast<std::size_t>(block)];
      change = std::max(change, std::numeric_limits<float>::min());
    }
  }
  return changes;
}

std::vector<proto::Frames> ChangeStream::advance(const FrameSource& result,
                                                 const std::vector<FrameRange>& looked_at) {
  if (sequence_ != 0 && result.sequence() <= sequence_) return {};
  const Eigen::MatrixXf* now = result.coordinates();
  const bool is_continued = sequence_ != 0 && now != nullptr && now->size() > 0 &&
                            now->rows() == sent_.rows() && now->cols() == sent_.cols() &&
                            result.basis_hash() == basis_hash_;
  if (!is_continued) return begin(result);
  const Changes changes = compare(result);
  std::vector<bool> is_looked_at(changes.of_block.size());
  std::vector<FrameRange> ranges;
  for (const FrameRange& looked : looked_at) {
    const auto is_new = [&](int block) {
      const bool is_inside = block * kBlock < end_of(looked) && (block + 1) * kBlock > looked.first;
      return is_inside && !is_looked_at[static_cast<std::size_t>(block)];
    };
    std::vector<FrameRange> first = changes.ranges(is_new);
    join_nearest(first, 1);
    for (const FrameRange& range : first) {
      const auto at = is_looked_at.begin() + range.first / kBlock;
      std::fill(at, at + block_count(range.count), true);
      ranges.push_back(range);
    }
  }
  std::vector<FrameRange> others =
      changes.ranges([&](int block) { return !is_looked_at[static_cast<std::size_t>(block)]; });
  join_nearest(others, kMostRanges);
  std::stable_sort(others.begin(), others.end(), [&](FrameRange a, FrameRange b) {
    return changes.largest(a) > changes.largest(b);
  });
  ranges.insert(ranges.end(), others.begin(), others.end());
  std::vector<proto::Frames> messages = encode(result, ranges, sequence_);
  keep(result, ranges);
  return messages;
}

std::vector<proto::Frames> ChangeStream::show_early(const FrameSource& part) {
  if (sequence_ == 0 || part.coordinates() == nullptr || part.basis_hash() != basis_hash_ ||
      part.coordinates()->rows() != sent_.rows())
    return {};
  proto::Frames frames = part.encode(proto::ENCODING_COORDINATES, {0, part.frame_count()});
  const FrameRange range{to_whole<int>(frames.first_frame()).value(), part.frame_count()};
  if (end_of(range) > sent_.cols()) return {};
  early_.push_back(range);
  proto::FrameChanges& changes = *frames.mutable_changes();
  changes.set_motion_frames(static_cast<std::uint32_t>(sent_.cols()));
  changes.set_base_sequence(sequence_);
  changes.set_early(true);
  return {std::move(frames)};
}

std::vector<proto::Frames> ChangeStream::begin(const FrameSource& result) {
  const std::vector<FrameRange> whole{{0, result.frame_count()}};
  std::vector<proto::Frames> messages = encode(result, whole, 0);
  // A client that holds this result already ignores it, even with early frames written over it.
  if (result.sequence() != sequence_ || result.basis_hash() != basis_hash_) early_.clear();
  if (result.coordinates() == nullptr) {
    sent_.resize(0, 0);
  } else {
    sent_ = *result.coordinates();
  }
  basis_hash_ = result.basis_hash();
  sequence_ = result.sequence();
  return messages;
}

void ChangeStream::keep(const FrameSource& result, const std::vector<FrameRange>& ranges) {
  for (const FrameRange& range : ranges)
    sent_.middleCols(range.first, range.count) =
        result.coordinates()->middleCols(range.first, range.count);
  sequence_ = result.sequence();
  early_.clear();
}

void ChangeStream::forget() {
  sequence_ = 0;
  sent_.resize(0, 0);
  early_.clear();
}

std::vector<proto::Frames> ChangeStream::encode(const FrameSource& result,
                                                const std::vector<FrameRange>& ranges,
                                                std::uint64_t base) const {
  std::vector<FrameRange> chunks;
  for (const FrameRange& range : ranges) {
    const auto parts = chunks_of(result, proto::ENCODING_COORDINATES, range, chunk_bytes_);
    chunks.insert(chunks.end(), parts.begin(), parts.end());
  }
  if (chunks.empty()) chunks.push_back({0, 0});
  std::vector<proto::Frames> messages;
  messages.reserve(chunks.size());
  for (const FrameRange& chunk : chunks) {
    messages.push_back(result.encode(proto::ENCODING_COORDINATES, chunk));
    proto::FrameChanges& changes = *messages.back().mutable_changes();
    changes.set_motion_frames(static_cast<std::uint32_t>(result.frame_count()));
    changes.set_base_sequence(base);
    changes.set_more(messages.size() < chunks.size());
    changes.set_part(static_cast<std::uint32_t>(messages.size() - 1));
  }
  return messages;
}

}  // namespace limber::server
