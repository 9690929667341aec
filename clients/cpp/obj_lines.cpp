#include "clients/cpp/obj_lines.h"

#include <cstdlib>
#include <sstream>

#include "engine/base/checked_number.h"

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
      // A word that is no number is no vertex: the server says so.
      const std::string_view digits = std::string_view(vertex).substr(0, vertex.find('/'));
      long number = parse_number<int>(digits).value_or(0);
      if (number < 0) number += std::ssize(obj.vertices) + 1;
      if (last != 0) obj.lines.emplace_back(last - 1, number - 1);
      last = number;
    }
  }
  return obj;
}

}  // namespace limber::client
