#include "engine/session/bodies/edit_batch.h"

namespace limber::session {

EditBatch batch_of(const Document& document, const Touched& touched) {
  EditBatch batch;
  for (const auto& [id, how] : touched.constraints) {
    const auto held = document.constraints().find(id);
    if (held == document.constraints().end()) {
      batch.removed.push_back(id);
    } else if (how == Touched::How::kTargetOnly) {
      batch.moved.push_back({id, held->second.target});
    } else {
      batch.set.push_back(held->second);
    }
  }
  if (touched.ends) batch.ends = EndsChange{document.first_end(), document.last_end()};
  if (touched.dynamics) batch.dynamics = document.dynamics();
  if (touched.material) batch.material = document.material();
  if (touched.pins) batch.pins = document.pins();
  if (touched.keyframes) batch.keyframes = document.keyframe_list();
  return batch;
}

EditBatch whole_batch(const Document& document) {
  EditBatch batch;
  batch.set = document.constraint_list();
  batch.ends = EndsChange{document.first_end(), document.last_end()};
  batch.dynamics = document.dynamics();
  batch.material = document.material();
  batch.pins = document.pins();
  batch.keyframes = document.keyframe_list();
  return batch;
}

}  // namespace limber::session
