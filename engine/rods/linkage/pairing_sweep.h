#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/rods/linkage/joint_pairing.h"

namespace limber::rods::detail {

/// The possible pairings of the segments that meet at a joint.
struct JointChoices {
  std::vector<int> segments;      // of its spokes
  std::vector<Pairing> pairings;  // of the spokes, the straightest first
};

/// Letters of segments: which family of rods they belong to; -1: not known.
using SegmentLetters = std::vector<signed char>;

/// Finds pairings of joints under which segments have letters: equal along each rod, different for
/// the two rods of a joint. Goes from joint to joint and keeps the cheapest choice for each set of
/// letters of the segments that lead on from there (the frontier). If there are too many sets, only
/// the cheapest are kept.
class PairingSweep {
 public:
  /// @param joints   all of the mesh
  /// @param members  those to choose for; segments between them and others have a known letter
  /// @param letters  of all segments. Ones known stay
  PairingSweep(const std::vector<JointChoices>& joints, std::vector<int> members,
               const SegmentLetters& letters);

  struct Result {
    bool found = false;
    bool is_least = false;      // nothing cheaper exists
    double cost = 0;            // sum of bends beyond the straightest
    std::vector<int> pairings;  // of each member
  };
  /// @param width  of the frontier: how many sets of letters are kept at a time
  /// @param below  only cheaper choices are searched
  [[nodiscard]] Result run(std::size_t width, double below) const;

 private:
  static constexpr std::size_t kWords = 8;
  using Bits = std::array<std::uint64_t, kWords>;

  /// Work of the sweep at one joint.
  struct Stop {
    int member;
    std::vector<int> slots;    // of each spoke: where its letter is, -1: nowhere
    std::vector<char> is_new;  // is that written here, not read
    std::vector<int> known;    // letters of spokes with no slot, -1
    Bits in_use;               // slots afterwards
  };
  struct Kept {
    Bits bits{};
    double cost = 0;
    int parent = -1;
    int pairing = 0;
  };

  void order_members(const SegmentLetters& letters);
  void place_slots(const SegmentLetters& letters);
  void extend(const Stop& stop, const Kept& from, int parent, double below,
              std::vector<Kept>& next) const;

  const std::vector<JointChoices>& joints_;
  std::vector<int> members_;
  std::vector<int> order_;  // of members
  std::vector<Stop> stops_;
  bool is_symmetric_ = true;  // no letters are known: all can be exchanged
  bool has_room_ = true;
};

}  // namespace limber::rods::detail
