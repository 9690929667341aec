#pragma once

#include <string>
#include <vector>

#include "limber/v1/service.pb.h"
#include "server/wire/frame_source.h"
#include "tests/engine/session/springs/session.h"

namespace limber::server::springs {

namespace chain = session::springs;

/// @throws Refusal or Error with a path below `prefix`
[[nodiscard]] chain::Chain decode_chain(const proto::Scene& scene, const std::string& prefix);
[[nodiscard]] proto::Scene encode_chain(const chain::Chain& chain, const std::string& name);

/// @throws Refusal with fields "edits[i].extension...."
[[nodiscard]] std::vector<chain::SpringEdit> decode_edits(const proto::EditRequest& request);
[[nodiscard]] proto::ResultInfo encode_result(const chain::SpringResult& result);

/// The shape of one result: a frame of positions. Coordinates are positions, too: 3 a node.
class ChainFrames final : public FrameSource {
 public:
  explicit ChainFrames(std::shared_ptr<const chain::SpringResult> result)
      : result_(std::move(result)) {}

  [[nodiscard]] std::uint64_t sequence() const override { return result_->sequence; }
  [[nodiscard]] int frame_count() const override { return 1; }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding encoding, int count) const override;
  [[nodiscard]] proto::Frames encode(proto::Encoding encoding, FrameRange range) const override;

 private:
  std::shared_ptr<const chain::SpringResult> result_;
};

}  // namespace limber::server::springs
