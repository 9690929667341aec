// Requests about scenes that are not open.
#include "server/service/chosen_ids.h"
#include "server/service/service.h"

namespace limber::server {

proto::ValidateSceneResponse Service::validate_scene(
    const proto::ValidateSceneRequest& request) const {
  proto::ValidateSceneResponse response;
  for (auto& issue :
       kinds_.of(request.scene(), "scene").validate(request.scene(), "scene.", scenes_)) {
    *response.add_issues() = std::move(issue);
  }
  add_issues_of_ids(request.scene(), response);
  return response;
}

proto::GetSampleResponse Service::get_sample(const proto::GetSampleRequest& request) const {
  proto::GetSampleResponse response;
  for (const auto& name : kinds_.sample_names()) response.add_names(name);
  if (!request.name().empty()) *response.mutable_scene() = kinds_.sample(request.name());
  return response;
}

}  // namespace limber::server
