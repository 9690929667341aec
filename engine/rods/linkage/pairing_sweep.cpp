#include "engine/rods/linkage/pairing_sweep.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

namespace limber::rods::detail {
namespace {

constexpr double kCostRounding = 1e-12;  // of costs

/// Which members each segment touches.
std::map<int, std::vector<int>> members_of_segments(const std::vector<JointChoices>& joints,
                                                    const std::vector<int>& members) {
  std::map<int, std::vector<int>> of_segment;
  for (std::size_t m = 0; m < members.size(); ++m)
    for (const int segment : joints[members[m]].segments)
      of_segment[segment].push_back(static_cast<int>(m));
  return of_segment;
}

}  // namespace

PairingSweep::PairingSweep(const std::vector<JointChoices>& joints, std::vector<int> members,
                           const SegmentLetters& letters)
    : joints_(joints), members_(std::move(members)) {
  order_members(letters);
  place_slots(letters);
}

/// From one end of the part to the other, by joints that leave the frontier short.
void PairingSweep::order_members(const SegmentLetters& letters) {
  const auto of_segment = members_of_segments(joints_, members_);
  const std::size_t count = members_.size();
  const auto each_neighbour = [&](int m, const auto& visit) {
    for (const int segment : joints_[members_[m]].segments) {
      if (letters[segment] >= 0) continue;
      for (const int other : of_segment.at(segment))
        if (other != m) visit(other);
    }
  };
  const auto farthest_from = [&](int first, std::vector<char> visited) {
    std::vector<int> reached = {first};
    visited[first] = 1;
    for (std::size_t i = 0; i < reached.size(); ++i)
      each_neighbour(reached[i], [&](int other) {
        if (!std::exchange(visited[other], 1)) reached.push_back(other);
      });
    return reached.back();
  };
  std::vector<char> placed(count, 0);
  std::vector<int> open(count, 0), met(count, 0), since(count, 0);
  for (std::size_t m = 0; m < count; ++m)
    each_neighbour(static_cast<int>(m), [&](int) { ++open[m]; });
  // By how much a joint lengthens the frontier; of equals the one that waits longest.
  std::set<std::tuple<int, int, int>> frontier;
  const auto key = [&](int m) { return std::tuple(open[m] - 2 * met[m], since[m], m); };
  const auto place = [&](int m) {
    placed[m] = 1;
    order_.push_back(m);
    each_neighbour(m, [&](int other) {
      if (placed[other]) return;
      frontier.erase(key(other));
      if (met[other]++ == 0) since[other] = static_cast<int>(order_.size());
      frontier.insert(key(other));
    });
  };
  for (std::size_t m = 0; m < count; ++m) {
    if (placed[m]) continue;
    place(farthest_from(farthest_from(static_cast<int>(m), placed), placed));
    while (!frontier.empty()) {
      const int next = std::get<2>(*frontier.begin());
      frontier.erase(frontier.begin());
      place(next);
    }
  }
}

void PairingSweep::place_slots(const SegmentLetters& letters) {
  const auto of_segment = members_of_segments(joints_, members_);
  std::map<int, int> slots;  // of segments on the frontier
  std::priority_queue<int, std::vector<int>, std::greater<>> free;
  int used = 0;
  for (const int member : order_) {
    Stop stop{member, {}, {}, {}, {}};
    std::vector<int> released;
    for (const int segment : joints_[members_[member]].segments) {
      stop.known.push_back(letters[segment]);
      stop.slots.push_back(-1);
      stop.is_new.push_back(0);
      if (letters[segment] >= 0) {
        is_symmetric_ = false;
      } else if (const auto found = slots.find(segment); found != slots.end()) {
        stop.slots.back() = found->second;
        released.push_back(found->second);
        slots.erase(found);
      } else if (of_segment.at(segment).size() == 2) {
        int slot = used;
        if (free.empty()) {
          ++used;
        } else {
          slot = free.top();
          free.pop();
        }
        slots.emplace(segment, slot);
        stop.slots.back() = slot;
        stop.is_new.back() = 1;
      }
    }
    for (const int slot : released) free.push(slot);
    if (used > static_cast<int>(64 * kWords)) {
      has_room_ = false;
      return;
    }
    for (const auto& [segment, slot] : slots)
      stop.in_use[slot / 64] |= std::uint64_t{1} << slot % 64;
    stops_.push_back(std::move(stop));
  }
}

void PairingSweep::extend(const Stop& stop, const Kept& from, int parent, double below,
                          std::vector<Kept>& next) const {
  const JointChoices& joint = joints_[members_[stop.member]];
  const double straightest = joint.pairings.front().bend;
  for (std::size_t p = 0; p < joint.pairings.size(); ++p) {
    const double cost = from.cost + (joint.pairings[p].bend - straightest);
    if (!(cost < below)) continue;
    for (const int flip : {0, 1}) {
      Kept kept{from.bits, cost, parent, static_cast<int>(p)};
      bool fits = true;
      for (int r = 0; r < 2; ++r) {
        for (const int spoke : joint.pairings[p].rods[r]) {
          const int letter = r ^ flip, slot = stop.slots[spoke];
          if (slot < 0) {
            fits = fits && (stop.known[spoke] < 0 || stop.known[spoke] == letter);
            continue;
          }
          const std::uint64_t bit = std::uint64_t{1} << slot % 64;
          std::uint64_t& word = kept.bits[slot / 64];
          if (stop.is_new[spoke]) {
            word = letter != 0 ? word | bit : word & ~bit;
          } else {
            fits = fits && ((from.bits[slot / 64] & bit) != 0) == (letter != 0);
          }
        }
      }
      if (!fits) continue;
      std::size_t first = 0;
      while (first < kWords && stop.in_use[first] == 0) ++first;
      const bool exchange =
          is_symmetric_ && first < kWords &&
          (kept.bits[first] & stop.in_use[first] & (~stop.in_use[first] + 1)) != 0;
      for (std::size_t w = 0; w < kWords; ++w)
        kept.bits[w] = (exchange ? ~kept.bits[w] : kept.bits[w]) & stop.in_use[w];
      next.push_back(kept);
    }
  }
}

PairingSweep::Result PairingSweep::run(std::size_t width, double below) const {
  Result result;
  if (!has_room_) return result;
  const auto by_cost = [](const Kept& a, const Kept& b) {
    return std::tie(a.cost, a.bits) < std::tie(b.cost, b.bits);
  };
  double left_out = std::numeric_limits<double>::infinity();  // cheapest
  std::vector<std::vector<std::pair<int, int>>> history;      // parent and pairing
  std::vector<Kept> kept = {Kept{}}, next;
  for (const Stop& stop : stops_) {
    next.clear();
    for (std::size_t k = 0; k < kept.size(); ++k)
      extend(stop, kept[k], static_cast<int>(k), below, next);
    std::sort(next.begin(), next.end(), [](const Kept& a, const Kept& b) {
      return std::tie(a.bits, a.cost, a.parent, a.pairing) <
             std::tie(b.bits, b.cost, b.parent, b.pairing);
    });
    next.erase(std::unique(next.begin(), next.end(),
                           [](const Kept& a, const Kept& b) { return a.bits == b.bits; }),
               next.end());
    if (next.size() > width) {
      const auto end = next.begin() + static_cast<std::ptrdiff_t>(width);
      std::nth_element(next.begin(), end, next.end(), by_cost);
      left_out = std::min(left_out, end->cost);
      next.erase(end, next.end());
      std::sort(next.begin(), next.end(), by_cost);
    }
    if (next.empty()) {
      result.is_least = std::isinf(left_out);
      return result;
    }
    history.emplace_back();
    for (const Kept& one : next) history.back().emplace_back(one.parent, one.pairing);
    std::swap(kept, next);
  }
  const auto best = std::min_element(kept.begin(), kept.end(), by_cost);
  result.found = true;
  result.cost = best->cost;
  result.is_least = best->cost <= left_out + kCostRounding;
  result.pairings.assign(members_.size(), 0);
  int at = static_cast<int>(best - kept.begin());
  for (std::size_t i = stops_.size(); i-- > 0;) {
    result.pairings[stops_[i].member] = history[i][at].second;
    at = history[i][at].first;
  }
  return result;
}

}  // namespace limber::rods::detail
