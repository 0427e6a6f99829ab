"""Faces of a surface of free form, by its triangles: the search for cylinders and cones.

Bumpy spheres, which have none, after compilation. The last column is what a triangle takes over
what one of the smallest takes; 1 throughout where a surface takes as long as it is large.
What was measured is in the decisions of the part.
"""

import time

from bench_closest import bumpy_sphere

from gradedesign.geometry.part.smooth_faces import segment_faces

SIZES = (25, 50, 71, 141)


def main():
    segment_faces(bumpy_sphere(10))
    first = None
    for n in SIZES:
        surface = bumpy_sphere(n)
        start = time.process_time()
        segment_faces(surface)
        each = (time.process_time() - start) / len(surface.faces)
        first = first or each
        n, share = len(surface.faces), each / first
        print(f"{n:7d} triangles {each * n:7.1f} s {1e3 * each:.2f} ms each, {share:.2f}")


if __name__ == "__main__":
    main()
