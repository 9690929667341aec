#include "tests/server/kinds/springs/record.h"

#include <utility>

#include "server/runtime/export_parts.h"
#include "server/wire/arrays.h"
#include "server/wire/file_stem.h"
#include "server/wire/scene_json.h"
#include "springs.pb.h"
#include "tests/server/kinds/springs/messages.h"

namespace limber::server::springs {

ChainRecord::ChainRecord(Hub& hub, const SessionKey& key, std::string name,
                         session::springs::Chain opened, JobId open_job)
    : SessionRecord(hub, key, name, open_job), name_(std::move(name)), opened_(std::move(opened)) {}

proto::EditResponse ChainRecord::edit(const proto::EditRequest& request,
                                      const session::Author& author) {
  return begin_response(make_edits(request, decode_edits(request), author));
}

const google::protobuf::Message* ChainRecord::edit_extension() const {
  return &limber::springs::ChainEdit::default_instance();
}

proto::Scene ChainRecord::edited_scene() const {
  session::springs::Chain chain = opened_;
  chain.conditions = *session()->conditions();
  return encode_chain(chain, name_);
}

void ChainRecord::add_scene(const proto::GetSessionRequest&,
                            proto::GetSessionResponse& response) const {
  *response.mutable_scene() = edited_scene();
}

std::shared_ptr<const FrameSource> ChainRecord::frames(bool final_only) const {
  return std::make_shared<ChainFrames>(demand_result(final_only));
}

proto::GetGeometryResponse ChainRecord::geometry(const proto::GetGeometryRequest&) const {
  (void)session();
  proto::GetGeometryResponse response;
  *response.mutable_rest() = encode_points(opened_.nodes);
  return response;
}

proto::ExportResponse ChainRecord::export_part(const proto::ExportRequest& request) {
  const std::string stem = decode_file_stem(request.stem(), "chain");
  if (request.format() != proto::EXPORT_FORMAT_SCENE)
    throw invalid("format", "a chain of springs is exported as SCENE");
  return cut_into_parts({{stem + ".json", scene_to_json(edited_scene())}}, request.part());
}

void ChainRecord::describe(proto::SessionStatus& status) const {
  if (const auto session = attached_session()) status.set_revision(session->revision());
}

void ChainRecord::on_result(const std::shared_ptr<const session::springs::SpringResult>& result) {
  note_result(std::make_shared<proto::ResultInfo>(encode_result(*result)),
              [&] { return std::make_shared<ChainFrames>(result); });
}

}  // namespace limber::server::springs
