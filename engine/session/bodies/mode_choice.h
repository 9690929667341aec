#pragma once

#include <optional>
#include <string>
#include <vector>

namespace limber::session {

/// How a session chooses r where its scene does not name it.
struct ModeChoiceOptions {
  double growth = 1.5;  // a question compares with so many times r modes, > 1
  /// Modes that are always taken where the mesh has them, > 0. Fewer save an edit little: the
  /// frames of its final result cost the same (docs/speed-against-error.md).
  int least = 30;
  int most = 120;  // modes at most, >= least
  /// The number of modes shrinks if that raises the energy by at most this share of the tolerance,
  /// in (0, 1). It grows only at the full tolerance, so that r does not oscillate.
  double shrink_share = 0.25;
  /// The question is asked again where the energy has changed by more than this factor, > 1.
  double energy_factor = 4;
  // Larger scenes keep their modes. With more tets, the comparison takes minutes when modes grow;
  // with more frames, one of its steps takes longer than an edit may wait for a processor. All >=
  // 0.
  int most_tets = 60'000;
  int most_frames = 30'000;
  double most_tet_readings = 4e6;  // tets times constraints

  void validate() const;
};

/// The optimal energy with so many modes, by the full map.
struct ModeEnergy {
  int modes = 0;
  double energy = 0;
};

/// Findings of a session about the number of modes that its scene needs.
struct ModeChoice {
  enum class State {
    kOff,      // the session does not choose
    kNamed,    // the scene names r
    kUnasked,  // not asked yet, left out or not answered: `reason`
    kSettled,  // more modes change the optimal energy by no more than the tolerance
    kBounded,  // they would change it by more, and no more are taken: `reason`
  };
  State state = State::kOff;
  int modes = 0;                     // r, elastic modes that swing
  std::vector<ModeEnergy> energies;  // that were compared, ascending
  std::string reason;                // a clause for a person
  /// Share of the energy that more modes would save, as far as they were tried; none: not known.
  std::optional<double> saving;
  /// Fewer modes whose energy is the same within the tolerance's shrink_share; 0: none were found.
  int fewer = 0;
};

/// (energy of fewer - energy of more) / energy of more; 0 where both vanish.
[[nodiscard]] double energy_saving(double fewer, double more);

}  // namespace limber::session
