#include "engine/scene/triangle_surface.h"
