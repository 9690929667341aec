#include "engine/rods/linkage/pairing_choice.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>

#include "engine/base/error.h"
#include "engine/rods/linkage/parity_forest.h"

namespace limber::rods::detail {
namespace {

// Letters of the frontier kept at a time, in turn until the choice is proven least.
constexpr std::array<std::size_t, 3> kWidths = {32, 512, 8192};
constexpr std::size_t kMaxRetainedStates = std::size_t{1} << 22;  // over all joints of a part
constexpr std::size_t kWindow = 40;                               // joints of an improvement
constexpr std::array<std::size_t, 3> kWindows = {40, 160, 640};   // of a first choice, in turn
constexpr std::size_t kWindowWidth = 512;
constexpr int kMaxRounds = 4;      // of improvements over a part
constexpr int kMaxWindows = 4000;  // improvements tried in a mesh, of some milliseconds each

class Choice {
 public:
  Choice(int segments, const std::vector<JointChoices>& joints)
      : joints_(joints),
        letters_(static_cast<std::size_t>(segments), -1),
        straight_(static_cast<std::size_t>(segments)),
        visits_(joints.size(), 0) {
    choice_.pairings.assign(joints.size(), 0);
    joints_of_.assign(letters_.size(), {-1, -1});
    for (std::size_t j = 0; j < joints.size(); ++j) {
      for (const int segment : joints[j].segments) {
        auto& of = joints_of_[segment];
        of[of[0] < 0 ? 0 : 1] = static_cast<int>(j);
      }
    }
  }

  PairingChoice run() {
    for (const std::vector<int>& part : parts())
      if (!fits(part)) choose(part);
    choice_.bent = static_cast<int>(std::count_if(choice_.pairings.begin(), choice_.pairings.end(),
                                                  [](int pairing) { return pairing != 0; }));
    return std::move(choice_);
  }

 private:
  [[nodiscard]] std::vector<std::vector<int>> parts() {
    std::vector<std::vector<int>> all;
    begin_visit();
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      if (is_visited(static_cast<int>(j))) continue;
      all.push_back(add_around(static_cast<int>(j), joints_.size()));
      std::sort(all.back().begin(), all.back().end());
    }
    return all;
  }

  void begin_visit() { ++visit_; }
  [[nodiscard]] bool is_visited(int joint) const { return visits_[joint] == visit_; }

  /// The nearest joints to one, breadth first; these are visited then, and no others.
  std::vector<int> around(int joint, std::size_t count) {
    begin_visit();
    return add_around(joint, count);
  }
  /// The same of those that are not visited yet.
  std::vector<int> add_around(int joint, std::size_t count) {
    std::vector<int> near = {joint};
    visits_[joint] = visit_;
    for (std::size_t i = 0; i < near.size(); ++i) {
      for (const int segment : joints_[near[i]].segments) {
        for (const int other : joints_of_[segment]) {
          if (other < 0 || near.size() >= count || is_visited(other)) continue;
          visits_[other] = visit_;
          near.push_back(other);
        }
      }
    }
    return near;
  }

  /// Can segments have letters under the straightest pairings? Asked once of each part.
  [[nodiscard]] bool fits(const std::vector<int>& part) {
    bool all = true;
    for (const int j : part) {
      const JointChoices& joint = joints_[j];
      const Pairing& pairing = joint.pairings[choice_.pairings[j]];
      const int first = joint.segments[pairing.rods[0][0]];
      for (int r = 0; r < 2; ++r)
        for (const int spoke : pairing.rods[r])
          all = straight_.join(first, joint.segments[spoke], r) && all;
    }
    return all;
  }

  void choose(const std::vector<int>& part) {
    if (!can_fit(part)) {
      choice_.is_mixed = true;
      return;
    }
    for (const int j : part)
      for (const int segment : joints_[j].segments) letters_[segment] = -1;
    const PairingSweep sweep(joints_, part, letters_);
    PairingSweep::Result best;
    best.cost = std::numeric_limits<double>::infinity();
    for (const std::size_t width : kWidths) {
      PairingSweep::Result result = sweep.run(
          std::min(width, std::max<std::size_t>(64, kMaxRetainedStates / part.size())), best.cost);
      best.is_least = result.is_least;
      if (result.found) best = std::move(result);
      if (best.is_least) break;
    }
    if (best.found) {
      for (std::size_t m = 0; m < part.size(); ++m) choice_.pairings[part[m]] = best.pairings[m];
      note_letters(part);
    } else if (best.is_least || !keep_straightest(part)) {
      for (const int j : part) choice_.pairings[j] = 0;
      choice_.is_mixed = true;
      return;
    }
    if (best.is_least) return;
    choice_.is_least = false;
    improve(part);
  }

  /// Takes the straightest pairings of as many joints as fit together, from neighbour to neighbour
  /// so that misfits are near their cause. Then chooses anew around the rest.
  /// @returns false where that finds no letters
  bool keep_straightest(const std::vector<int>& part) {
    ParityForest forest(letters_.size());
    std::vector<int> others;
    for (const int j : around(part.front(), joints_.size())) {
      choice_.pairings[j] = 0;
      if (!join_if_fits(j, 0, forest)) others.push_back(j);
    }
    std::vector<int> left;
    for (const int j : others) {
      const int count = static_cast<int>(joints_[j].pairings.size());
      int p = 1;
      while (p < count && !join_if_fits(j, p, forest)) ++p;
      choice_.pairings[j] = p < count ? p : 0;
      if (p == count) left.push_back(j);
    }
    for (const int j : part) {
      for (const int segment : joints_[j].segments)
        letters_[segment] = static_cast<signed char>(forest.root(segment).parity);
    }
    return std::all_of(left.begin(), left.end(), [&](int j) {
      return fits_letters(j) ||
             std::any_of(kWindows.begin(), kWindows.end(), [&](std::size_t joints) {
               return ++windows_ < kMaxWindows && choose_around(j, joints, Aim::kAnyThatFits);
             });
    });
  }

  bool join_if_fits(int j, int p, ParityForest& forest) const {
    if (!fits_forest(j, p, forest)) return false;
    join(j, p, forest);
    return true;
  }

  [[nodiscard]] bool fits_forest(int j, int p, ParityForest& forest) const {
    const JointChoices& joint = joints_[j];
    const Pairing& pairing = joint.pairings[p];
    std::vector<ParityForest::Root> roots;
    for (int r = 0; r < 2; ++r) {
      for (const int spoke : pairing.rods[r]) {
        const auto [item, parity] = forest.root(joint.segments[spoke]);
        for (const auto& other : roots)
          if (other.item == item && other.parity != (parity ^ r)) return false;
        roots.push_back({item, parity ^ r});
      }
    }
    return true;
  }

  void join(int j, int p, ParityForest& forest) const {
    const JointChoices& joint = joints_[j];
    const Pairing& pairing = joint.pairings[p];
    const int first = joint.segments[pairing.rods[0][0]];
    for (int r = 0; r < 2; ++r)
      for (const int spoke : pairing.rods[r])
        LIMBER_DEMAND(forest.join(first, joint.segments[spoke], r));
  }

  /// False: pairings that leave no choice, and those that follow from them, contradict each other.
  [[nodiscard]] bool can_fit(const std::vector<int>& part) const {
    ParityForest forest(letters_.size());
    std::vector<int> open = part;
    for (bool more = true; more;) {
      more = false;
      std::vector<int> left;
      for (const int j : open) {
        int fitting = 0, last = 0;
        for (int p = 0; p < static_cast<int>(joints_[j].pairings.size()); ++p) {
          if (!fits_forest(j, p, forest)) continue;
          ++fitting;
          last = p;
        }
        if (fitting == 0) return false;
        if (fitting > 1) {
          left.push_back(j);
        } else {
          join(j, last, forest);
          more = true;
        }
      }
      open = std::move(left);
    }
    return true;
  }

  /// Notes the letters of the chosen pairings, which fit together.
  void note_letters(const std::vector<int>& part) {
    const auto letter_of = [&](const JointChoices& joint, const Pairing& pairing) {
      for (int r = 0; r < 2; ++r)
        for (const int spoke : pairing.rods[r])
          if (letters_[joint.segments[spoke]] >= 0) return letters_[joint.segments[spoke]] ^ r;
      return 0;
    };
    for (const int j : around(part.front(), joints_.size())) {
      const JointChoices& joint = joints_[j];
      const Pairing& pairing = joint.pairings[choice_.pairings[j]];
      const int first = letter_of(joint, pairing);
      for (int r = 0; r < 2; ++r)
        for (const int spoke : pairing.rods[r])
          letters_[joint.segments[spoke]] = static_cast<signed char>(first ^ r);
    }
  }

  [[nodiscard]] bool fits_letters(int j) const {
    const JointChoices& joint = joints_[j];
    const auto same = [&](const std::vector<int>& rod, int letter) {
      return std::all_of(rod.begin(), rod.end(),
                         [&](int spoke) { return letters_[joint.segments[spoke]] == letter; });
    };
    const auto& rods = joint.pairings[choice_.pairings[j]].rods;
    const int letter = letters_[joint.segments[rods[0][0]]];
    return same(rods[0], letter) && same(rods[1], 1 - letter);
  }

  /// Chooses anew around joints that do not take their straightest pairing, the letters around
  /// staying as they are.
  void improve(const std::vector<int>& part) {
    for (int round = 0; round < kMaxRounds; ++round) {
      bool any = false;
      for (const int j : part)
        if (choice_.pairings[j] != 0 && windows_++ < kMaxWindows)
          any = choose_around(j, kWindow, Aim::kStraighter) || any;
      if (!any || windows_ >= kMaxWindows) return;
    }
  }

  enum class Aim { kStraighter, kAnyThatFits };

  bool choose_around(int joint, std::size_t joints, Aim aim) {
    const std::vector<int> window = around(joint, joints);
    double cost = 0;
    std::vector<std::pair<int, signed char>> before;  // segments and their letters
    for (const int j : window) {
      const std::vector<Pairing>& pairings = joints_[j].pairings;
      cost += pairings[choice_.pairings[j]].bend - pairings[0].bend;
      for (const int segment : joints_[j].segments) {
        const auto& ends = joints_of_[segment];
        if (ends[1] >= 0 && !(is_visited(ends[0]) && is_visited(ends[1]))) continue;
        if (letters_[segment] >= 0) before.emplace_back(segment, letters_[segment]);
        letters_[segment] = -1;
      }
    }
    const PairingSweep sweep(joints_, window, letters_);
    const PairingSweep::Result result =
        sweep.run(kWindowWidth,
                  aim == Aim::kStraighter ? cost - 1e-9 : std::numeric_limits<double>::infinity());
    if (!result.found) {
      for (const auto& [segment, letter] : before) letters_[segment] = letter;
      return false;
    }
    for (std::size_t m = 0; m < window.size(); ++m)
      choice_.pairings[window[m]] = result.pairings[m];
    // From the letters around, which have not changed.
    if (!has_letter(window)) letters_[joints_[window.front()].segments.front()] = 0;
    for (bool more = true; more;) {
      more = false;
      for (const int j : window) more = spread_letters(j) || more;
    }
    return true;
  }

  [[nodiscard]] bool has_letter(const std::vector<int>& window) const {
    return std::any_of(window.begin(), window.end(), [&](int j) {
      const std::vector<int>& segments = joints_[j].segments;
      return std::any_of(segments.begin(), segments.end(),
                         [&](int segment) { return letters_[segment] >= 0; });
    });
  }

  /// To the segments of a joint that have none, where one has.
  bool spread_letters(int j) {
    const JointChoices& joint = joints_[j];
    const Pairing& pairing = joint.pairings[choice_.pairings[j]];
    int first = -1;
    bool is_missing = false;
    for (int r = 0; r < 2; ++r) {
      for (const int spoke : pairing.rods[r]) {
        const int letter = letters_[joint.segments[spoke]];
        is_missing = is_missing || letter < 0;
        if (letter >= 0) first = letter ^ r;
      }
    }
    if (first < 0 || !is_missing) return false;
    for (int r = 0; r < 2; ++r)
      for (const int spoke : pairing.rods[r])
        letters_[joint.segments[spoke]] = static_cast<signed char>(first ^ r);
    return true;
  }

  const std::vector<JointChoices>& joints_;
  SegmentLetters letters_;
  ParityForest straight_;                      // segments under the straightest pairings
  std::vector<std::array<int, 2>> joints_of_;  // of segments; -1: a free end
  std::vector<int> visits_;                    // of joints: the last visit that met them
  int visit_ = 0, windows_ = 0;
  PairingChoice choice_;
};

}  // namespace

PairingChoice choose_pairings(int segments, const std::vector<JointChoices>& joints) {
  return Choice(segments, joints).run();
}

}  // namespace limber::rods::detail
