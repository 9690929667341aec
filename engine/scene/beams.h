#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

namespace limber::scene {

/// A network of edges whose vertices have normals, as files draw beam structures.
struct EdgeMesh {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xd normals;  // as in the file; (0, 0, 1) if it has none
  std::vector<std::pair<int, int>> edges;
};

/// A job of the public dynamic relaxation code (bending-active structures): SimulationJob.json and
/// DRMSettings.json. One rectangular section of one material for all edges. SI.
struct BeamJob {
  struct Fixed {
    int vertex = 0;
    std::array<bool, 6> directions{};  // three translations, two of the normal, spin about it
  };
  struct Force {
    int vertex = 0;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();   // [N]
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // [N m]
  };
  struct Displacement {
    int vertex = 0;
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // [m]
  };

  std::string label;
  std::string mesh_file;                         // beside the job
  double section_width = 0, section_height = 0;  // [m], the height along the normal
  double poisson = 0, young = 0;                 // -, [Pa]
  std::vector<Fixed> fixed;
  std::vector<Force> forces;
  std::vector<Displacement> displacements;
  /// Force and moment on every vertex while the structure leaves its plane; zero: none.
  Eigen::Vector3d initial_force = Eigen::Vector3d::Zero();
  Eigen::Vector3d initial_moment = Eigen::Vector3d::Zero();
};

}  // namespace limber::scene
