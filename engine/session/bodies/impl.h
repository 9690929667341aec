#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/session/bodies/answer_cache.h"
#include "engine/session/bodies/document.h"
#include "engine/session/bodies/first_picture.h"
#include "engine/session/bodies/frame_steps.h"
#include "engine/session/bodies/full_body.h"
#include "engine/session/bodies/live_problem.h"
#include "engine/session/bodies/mode_chooser.h"
#include "engine/session/bodies/mode_question.h"
#include "engine/session/bodies/motion_check.h"
#include "engine/session/bodies/session.h"
#include "engine/session/bodies/start_search.h"
#include "engine/session/core/background_check.h"
#include "engine/session/core/session_core.h"

namespace limber::session {

/// The order that the task of a session of a body works on.
struct BodyOrder {
  enum class Start { kWarm, kCold };
  std::uint64_t content = 0;  // Document::content()
  EditBatch batch;
  bool is_whole = false;
  Start start = Start::kWarm;
  std::uint64_t cold_request = 0;    // the newest contained, of this round or an earlier one
  bool is_with_fewer_modes = false;  // the solver must be made anew with those that are enough
  bool is_with_other_pins = false;   // the solver must be made anew: its base motion is another
};

class BodySession::Impl final : public SessionCore<BodyResult, BodyOrder> {
 public:
  Impl(std::string id, scene::Scene scene, SessionOptions options,
       std::shared_ptr<ModelCache> cache, Executor executor,
       std::shared_ptr<BodyListener> listener);

  EditReceipt edit(const std::vector<BodyEdit>& edits, std::optional<Revision> expected,
                   const Author& author);
  void begin_at(const Document::Checkpoint& checkpoint);
  void demand_reachable(const Document::Checkpoint& checkpoint);
  void solve_cold(std::uint64_t request);
  void look_at(spacetime::FrameSpan frames);
  /// SessionCore::cancel(), and the choice of modes.
  void cancel();

  enum class BaseMotionPart { kIncluded, kLeftOut };
  [[nodiscard]] scene::Scene scene(BaseMotionPart base = BaseMotionPart::kIncluded) const;
  [[nodiscard]] Eigen::MatrixXd positions(const BodyResult& result, int first_frame,
                                          int frame_count) const;
  /// Results of the build for readers.
  struct Built {
    std::shared_ptr<const reduced::ReducedModel> model;
    /// As it was built; `model` may have more columns, for edited pins.
    std::shared_ptr<const reduced::ReducedModel> trunk;
    std::shared_ptr<const reduced::BaseMotion> base;  // null: none
    std::shared_ptr<const std::vector<int>> compact_of_source;
    std::string message;   // of the model's report, with its differences from the request
    std::string accuracy;  // of results, where the model misses its tolerance
    double seconds = 0;
    bool from_cache = false;
  };

  // With the lock, see read():
  [[nodiscard]] const Document& document() const { return document_; }
  [[nodiscard]] const std::shared_ptr<const Built>& built() const { return built_; }
  /// Newest last; those before it are kept for clients that have frames of them.
  [[nodiscard]] const std::deque<std::shared_ptr<const ShownBasis>>& shown() const {
    return shown_;
  }
  [[nodiscard]] const ModeChoice& mode_choice() const { return mode_choice_; }
  [[nodiscard]] const std::optional<FirstPictureInfo>& first_picture() const {
    return picture_info_;
  }

 private:
  using MotionChecks = BackgroundCheck<BodyResult, MotionCheck, CheckRequest>;
  using MotionFound = MotionChecks::Found;
  using ModeChoices = BackgroundCheck<BodyResult, ModeFinding, ModeRequest>;
  using ModesFound = ModeChoices::Found;
  using StartSearches = BackgroundCheck<BodyResult, StartFinding, StartRequest>;
  using StartsFound = StartSearches::Found;

  // impl.cpp: the shared half.
  Revision document_revision() const override { return document_.revision(); }
  BodyOrder take_order() override;
  void interrupt_round() override;
  void note_cancel() override { cold_ = false; }
  void note_lost_round() override { whole_ = true; }
  void note_close() override { interrupt_round(); }
  void close_other_tasks(SerialTask::Wait wait) override;

  // task.cpp: the task.
  std::string build(const JobContext& job) override;
  Built build_model(const JobContext& job);
  /// @param scene  outlives it
  [[nodiscard]] std::unique_ptr<LiveProblem> make_problem(
      const scene::Scene& scene, const MappedBody& mapped,
      std::shared_ptr<const reduced::ReducedModel> model,
      std::shared_ptr<const reduced::BaseMotion> base, int modes) const;
  [[nodiscard]] std::shared_ptr<const ShownBasis> make_shown(
      const MappedBody& mapped, const std::shared_ptr<const reduced::ReducedModel>& model) const;
  // first_picture_task.cpp: what is shown meanwhile.
  /// For large bodies: makes the picture and publishes it. Failures leave none.
  void begin_picture(const MappedBody& mapped, const reduced::ModelOptions& options,
                     const JobContext& job);
  /// `job`, extended: its reports also show the edits that have come.
  [[nodiscard]] JobContext with_picture(const JobContext& job);
  void show_edits(const JobContext& job);
  void solve(const Round& round) override;
  void solve_rest(const Round& round) override;
  void solve_failed(const Round& round, const std::string& reason) override;
  std::shared_ptr<const BodyResult> bring_up_to_date(const Round& round);
  void begin_in(const scene::StartMotion& start);

  // pins_task.cpp: base motions that edits make.
  /// Whether the batch has other pins than the task.
  [[nodiscard]] bool is_with_other_pins(const EditBatch& batch) const;
  /// Another base motion, a shown basis that has it, and a new solver over it.
  /// @param is_warm  it continues from the old one's z
  void use_pins(const EditBatch& whole, bool is_warm);
  /// Another solver in place of the present one; a warm one continues from that one's z, as far as
  /// it has these modes.
  void renew_problem(std::unique_ptr<LiveProblem> problem, const EditBatch& whole,
                     std::shared_ptr<const reduced::FrameShift> shift, bool is_warm);

  void solve_order(const Round& round);
  /// Solves the order of `round` to the end, its material included. @returns nothing if an edit
  /// made it out of date
  std::optional<spacetime::SolveReport> solve_whole(const Round& round);
  /// solver().solve(), published as it runs. @returns nothing where an edit made it out of date
  /// @param ceiling  motions of a higher total energy are not published
  std::optional<spacetime::SolveReport> solve_motion(
      const Round& round, double ceiling = std::numeric_limits<double>::infinity());
  [[nodiscard]] bool stay_with_answer(const Round& round, const spacetime::SolveReport& ended);

  // material_fit.cpp: the task's part of it that fits materials.
  /// A material with its motion z, r x N.
  struct Fit {
    std::shared_ptr<const spacetime::Material> material;
    Eigen::MatrixXd motion;
    bool is_exact = false;
  };
  enum class Steps { kFree, kLimited };
  /// On from the answer of the solver, which gets the material and the motion that were found where
  /// these are better. Nothing above the energy of the start is published, nor what moves nodes
  /// farther from one frame to the next than `most` [m].
  /// @param steps  kLimited: those of the fit keep within that, as far as some nodes show
  /// @returns nothing where an edit made it out of date
  std::optional<spacetime::MaterialReport> optimise_material(const Round& round, Steps steps,
                                                             double most);
  /// Runs optimise_material() and solves the motion for its result; keeps the converged start if
  /// that is better. If nodes move much farther from one frame to the next than at the start, it is
  /// repeated with limited steps. @returns as above
  std::optional<spacetime::SolveReport> fit_material(const Round& round,
                                                     const spacetime::SolveReport& start);
  void publish_material(const Round& round, const spacetime::MaterialReport& report,
                        const spacetime::MaterialSolver& solver);
  void restore(const Fit& fit);
  /// Of what the solver has.
  [[nodiscard]] Eigen::MatrixXf coordinates_now() const;
  /// The largest step of sampled nodes from one frame to the next [m] in the solver's motion; in
  /// full reconstructions if that is exact. @returns nothing if an edit came first
  [[nodiscard]] std::optional<double> largest_step_now(const Round& round);
  /// Energies of result.modal and result.report with this material.
  void fill_material(const spacetime::Material& material, BodyResult& result) const;
  /// Frames of result.modal with result.material by the model, with the known part of its error.
  void show_by_model(BodyResult& result) const;

  std::shared_ptr<const BodyResult> publish_motion(const Round& round,
                                                   const spacetime::SolveReport& report,
                                                   bool is_final);
  /// What publish_motion() publishes. A final one is not exact where a cancellation was quicker.
  /// @returns nothing where an edit was quicker
  std::shared_ptr<BodyResult> result_of_motion(const Round& round,
                                               const spacetime::SolveReport& report, bool is_final);
  void publish_of_round(std::shared_ptr<BodyResult> result, const Round& round);
  /// For a final result: notes the constraints out of reach, in its message too.
  void note_reach(BodyResult& result) const;

  // early_frames.cpp: for long motions, viewed and edited frames before the rest.
  void publish_early(const Round& round, const spacetime::SolveReport& report);
  /// Before a batch is applied: the frames that it is about.
  void note_edited(const EditBatch& batch);

  // exact.cpp: the step behind the reduced model's answer.
  [[nodiscard]] bool is_quiet();
  /// The exact optimum from the solver's motion, which was solved as `start` says.
  /// `start` is published first, unless its total energy is above the ceiling.
  /// @returns `start` where results are not exact; nothing where an edit made it out of date
  std::optional<spacetime::SolveReport> polish(
      const Round& round, const spacetime::SolveReport& start,
      double ceiling = std::numeric_limits<double>::infinity());
  /// If edits have led far from motions that were compared with the optimum from rest, finds that
  /// optimum too and gives the better one to the solver. @returns as polish()
  std::optional<spacetime::SolveReport> try_from_rest(const Round& round,
                                                      const spacetime::SolveReport& found);
  /// Frames of a motion by full reconstruction, h' x N, of problem_shown_, which may grow for them.
  /// @param reduced  the same by the model, LiveProblem::model_coordinates()
  /// @returns nothing where an edit or a cancellation was quicker
  [[nodiscard]] std::optional<Eigen::MatrixXf> frames_in_full(const Round& round,
                                                              const spacetime::Material& material,
                                                              const Eigen::MatrixXd& modal,
                                                              const Eigen::MatrixXf& reduced);
  /// Frames of an exact result. @returns false where an edit or a cancellation was quicker
  [[nodiscard]] bool show_exactly(const Round& round, BodyResult& result);
  void shift_frames(const Eigen::MatrixXf& reduced, const BodyResult& result);
  void take_up(const BodyResult& answer, spacetime::Known known);
  void provide_full();
  void provide_full_body();
  void set_shown(std::shared_ptr<const ShownBasis> shown);

  // check.cpp: the check of final results, its task and its place in the session's.
  bool do_other_work(std::unique_lock<std::mutex>& lock) override;
  [[nodiscard]] bool is_check_due() const;
  void begin_check(std::unique_lock<std::mutex>& lock);
  /// The check's task.
  MotionCheck check(const CheckRequest& request, const JobContext& job);
  void amend(const MotionFound& found);

  // start_search_task.cpp: optima from further starts, by a task of its own.
  /// With the lock, the task's: one thing to do about it, if there is any.
  bool do_search_work(std::unique_lock<std::mutex>& lock);
  void begin_search(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] bool is_search_due() const;
  /// For a final result: whether a search might find other optima of its problem in time.
  [[nodiscard]] bool is_several_optima_possible(const BodyResult& result) const;
  /// Starts that may be compared for the problem of now; 0: its size allows none.
  [[nodiscard]] int starts_to_compare() const;
  [[nodiscard]] int constraint_count() const;
  /// Whether starts were compared for a motion near this one, and for as many constraints.
  [[nodiscard]] bool is_searched(const Eigen::MatrixXd& motion) const;
  void adopt_start(const StartsFound& found);
  [[nodiscard]] std::shared_ptr<BodyResult> with_start(const StartFinding& finding,
                                                       const BodyResult& before,
                                                       const Round& round);

  // mode_choice_task.cpp: how many modes the scene needs, found out by a task of its own.
  /// With the lock, the task's: one thing to do about it, if there is any.
  bool do_mode_work(std::unique_lock<std::mutex>& lock);
  void begin_choice(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] bool is_choice_due() const;
  /// For a final result: whether to compare its modes with other numbers; if not, notes the reason.
  [[nodiscard]] bool is_question(const BodyResult& result);
  [[nodiscard]] std::string reason_against_question(const BodyResult& result);
  /// The session continues with the finding.
  void adopt(const ModesFound& found);
  /// What changes with the modes.
  struct WithModes {
    int modes = 0;
    std::unique_ptr<LiveProblem> problem;
    std::shared_ptr<FullBody> full_body;
    std::shared_ptr<const Built> built;
    std::shared_ptr<const ShownBasis> problem_shown;
    std::deque<std::shared_ptr<const ShownBasis>> shown;
    std::vector<Eigen::MatrixXd> transfers;
    Eigen::MatrixXd tried;
    std::optional<ModeQuestion> asked;
    bool from_rest = false, is_exact = false;
  };
  [[nodiscard]] WithModes with_more_modes(const ModeFinding& finding, const EditBatch& whole);
  void exchange_modes(WithModes& other);
  /// The final result with more modes, which are in use already; nothing is published where they
  /// are not to stay. @param before  the result with fewer
  /// @returns why it is not published; empty: it is, or an edit was quicker
  std::string publish_with_more_modes(const ModeFinding& finding, const BodyResult& before,
                                      const Round& round);
  /// The question will not be answered.
  void note_unanswered(std::string reason);
  /// @param whole  of the document; @param is_warm  the new solver continues from the old one's z
  void use_fewer_modes(const EditBatch& whole, bool is_warm);
  void note_modes();
  /// How often the modes have changed.
  [[nodiscard]] int mode_changes() const { return static_cast<int>(transfers_.size()); }
  /// The final result again: there is nothing more to wait for.
  void end_choice(const std::shared_ptr<const BodyResult>& result);
  /// z of a result in the modes of now.
  [[nodiscard]] Eigen::MatrixXd in_present_modes(const BodyResult& result) const;

  const SessionOptions options_;
  const std::shared_ptr<ModelCache> cache_;

  // Under the lock:
  Document document_;
  Touched touched_;    // since the task last looked
  bool whole_ = true;  // the solver must be made anew from the whole document
  bool cold_ = false;  // solve_cold() was called
  std::uint64_t cold_requested_ = 0, cold_taken_ = 0;  // requests of solve_cold(): given, begun
  std::shared_ptr<const Built> built_;
  std::shared_ptr<const std::vector<int>> compact_of_source_;  // with the first basis that is shown
  static constexpr std::size_t kShownKept = 4;  // bases that clients may still ask for
  std::deque<std::shared_ptr<const ShownBasis>> shown_;
  std::deque<spacetime::FrameSpan> views_;  // newest first
  Cancellation out_of_date_;                // of the running round; another one for each
  std::condition_variable gone_out_of_date_;
  ModeChoice mode_choice_;
  bool is_solving_ = false;           // a round runs, no other work
  bool is_choosing_ = false;          // a choice was begun, and is not out of date
  bool is_searching_ = false;         // for starts, and it is not out of date
  bool is_choice_cancelled_ = false;  // cancel() was called meanwhile
  bool is_search_cancelled_ = false;  // the same
  int fewer_modes_ = 0;               // to be used from the next round on; 0: none
  std::optional<FirstPictureInfo> picture_info_;

  /// The task's: of the document, with the base motion that its pins make.
  std::shared_ptr<const scene::Scene> scene_;
  PinPaths pins_;                                    // the task's: those of scene_
  std::unique_ptr<LiveProblem> problem_;             // the task's
  std::unique_ptr<FirstPicture> picture_;            // the task's, while it builds
  std::uint64_t pictured_ = 0;                       // the task's: Document::content() in it
  std::shared_ptr<FullBody> full_body_;              // the task's, once it is needed
  std::shared_ptr<const ShownBasis> problem_shown_;  // the task's: basis of the next result
  std::vector<int> edited_;                          // the task's: frames of the round's edits
  bool from_rest_ = false;        // the task's: the solver began there, and no edit has come since
  Eigen::MatrixXd tried_;         // the task's: z that was compared with the optimum from rest
  bool was_interrupted_ = false;  // the task's: the last exact step
  bool is_exact_ = false;         // the task's: the solver's motion is an optimum of the full map
  AnswerCache answers_;           // the task's
  bool has_begun_ = false;        // the task's: Scene::start was used, or is of no use any more
  bool solved_ = false;           // the task's: the motion has converged for the material it has
  /// The task's: q of the motion with forces alone that the fit of the material began with.
  std::shared_ptr<const Eigen::MatrixXf> start_of_fit_;
  int material_iterations_ = 0;  // the task's: for the next result

  int modes_ = 0;                           // the task's: r, elastic modes that swing
  scene::Dynamics dynamics_;                // the task's: as the solver has them
  std::optional<ModeQuestion> question_;    // the task's: that was asked last
  std::optional<ModeQuestion> asked_;       // the task's: and that was answered last
  std::vector<Eigen::MatrixXd> transfers_;  // the task's: of each change of modes, z' = T z

  std::unique_ptr<MotionChecker> checker_;  // the check's task's
  MotionChecks check_;
  std::unique_ptr<ModeChooser> chooser_;  // the choice's task's
  ModeChoices choice_;
  Eigen::MatrixXd searched_;      // the task's: z for which starts were compared
  int searched_constraints_ = 0;  // the task's: how many there were
  StartSearches search_;
};

}  // namespace limber::session
