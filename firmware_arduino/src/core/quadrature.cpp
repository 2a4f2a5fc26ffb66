#include "quadrature.h"

namespace hil {

const int8_t QUADRATURE_STEP[16] = {
    0,
    -1,
    +1,
    QUADRATURE_ILLEGAL,  // from 00
    +1,
    0,
    QUADRATURE_ILLEGAL,
    -1,  // from 01
    -1,
    QUADRATURE_ILLEGAL,
    0,
    +1,  // from 10
    QUADRATURE_ILLEGAL,
    +1,
    -1,
    0,  // from 11
};

void quadrature_update(Quadrature& q, uint8_t ab) {
  const uint8_t now = ab & 3u;
  const int8_t step = quadrature_step(q.last_ab & 3u, now);
  q.last_ab = now;
  if (step == QUADRATURE_ILLEGAL) {
    ++q.illegal;
  } else {
    q.counts += step;
  }
}

}  // namespace hil
