#include "clients/cpp/obj_lines.h"

#include <cstdlib>
#include <sstream>

namespace limber::client {

ObjLines read_obj_lines(const std::string& content) {
  ObjLines obj;
  std::istringstream lines(content);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "f") obj.has_faces = true;
    if (word == "v") {
      std::array<double, 3> point{};
      words >> point[0] >> point[1] >> point[2];
      obj.vertices.push_back(point);
    }
    if (word != "l") continue;
    long last = 0;
    for (std::string vertex; words >> vertex;) {
      long number = std::strtol(vertex.c_str(), nullptr, 10);
      if (number < 0) number += static_cast<long>(obj.vertices.size()) + 1;
      if (last != 0) obj.lines.emplace_back(last - 1, number - 1);
      last = number;
    }
  }
  return obj;
}

}  // namespace limber::client
