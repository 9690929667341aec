#include <utility>

#include "engine/session/bodies/impl.h"

// The session's first picture: shown by the task that builds the model, in between. Edits are in it
// as soon as the build reports, at most a second or two later (a factor cannot be interrupted), and
// the document keeps them for the model.

namespace limber::session {

namespace {

// The build waits for the picture: of longer motions, or more targets, there is none.
constexpr int kMostPictureFrames = 20'000;
constexpr std::size_t kMostPictureTargets = 200;

}  // namespace

void BodySession::Impl::begin_picture(const MappedBody& mapped,
                                      const reduced::ModelOptions& options, const JobContext& job) {
  const scene::Scene& scene = *document_.unedited();
  picture_.reset();
  const bool is_large = scene.frame_count > kMostPictureFrames ||
                        scene.constraints.size() + scene.keyframes.size() > kMostPictureTargets;
  if (mapped.body.mesh.tet_count() < options_.first_picture_tets || scene.base_motion.size() > 0 ||
      is_large)
    return;
  try {
    auto picture = std::make_unique<FirstPicture>(scene, document_.surface_points(), mapped,
                                                  options, options_.solver, cache_.get(), job);
    auto compact = std::make_shared<const std::vector<int>>(mapped.compact_of_source);
    {
      const std::lock_guard lock(mutex_);
      shown_ = {picture->shown()};
      compact_of_source_ = std::move(compact);
      picture_info_ = picture->info();
      pictured_ = document_.content() - 1;
    }
    picture_ = std::move(picture);
    show_edits(job);
  } catch (...) {
    picture_.reset();  // optional: the build itself reports errors of the body
    job.throw_if_cancelled();
  }
}

JobContext BodySession::Impl::with_picture(const JobContext& job) {
  return {job.cancellation, [this, job](const std::string& stage, double fraction) {
            if (job.progress) job.progress(stage, fraction);
            try {
              show_edits(job);
            } catch (...) {
              picture_.reset();
              job.throw_if_cancelled();
            }
          }};
}

void BodySession::Impl::show_edits(const JobContext& job) {
  if (!picture_) return;
  EditBatch whole;
  Revision revision = 0;
  Clock::time_point edited_at;
  {
    const std::lock_guard lock(mutex_);
    if (pictured_ == document_.content()) return;
    if (document_.constraints().size() > kMostPictureTargets) return;
    pictured_ = document_.content();
    whole = whole_batch(document_);
    revision = document_.revision();
    edited_at = edited_at_;
  }
  const auto show = [&](std::shared_ptr<BodyResult> result) {
    result->revision = revision;
    result->since_edit_ms =
        std::chrono::duration<double, std::milli>(Clock::now() - edited_at).count();
    publish(std::move(result));
  };
  if (*whole.pins) return;  // it knows no base motion
  picture_->take(whole);
  show(picture_->correct());
  job.throw_if_cancelled();
  const bool is_out_of_date = read([&] { return pictured_ != document_.content(); });
  if (!is_out_of_date) show(picture_->improve(job));
}

}  // namespace limber::session
