/* Triangles in a grid of cells: pairs that may intersect or touch, all that do and few that do not; triangles near points; parts.

   A regular grid finds overlapping boxes. A pair is left out only if a plane certainly separates its triangles, or if they share an
   edge. Only differences of coordinates are used, with relative rounding errors: SURE is thousands of these.
*/

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#define SURE 1e-12

#define LESS(a, b) ((a) < (b) ? (a) : (b))
#define MORE(a, b) ((a) > (b) ? (a) : (b))

typedef struct { /* with the first and last cells of a grid that it touches, and its longest edge */
    double low[3], high[3], size;
    int first[3], last[3];
} Box;
typedef struct { /* with the count boxes that are sorted into its cells, and the box around them */
    double low[3], edge;
    int size[3];
    int64_t count, *starts, *inside;
    Box *boxes, hull;
} Grid;
typedef struct { /* triangles (count, 3) of points (, 3) */
    int64_t count;
    const double *points;
    const int64_t *corners;
} Surface;
typedef struct { /* pairs (room, 2) of triangles of two surfaces, filled up to room */
    const Surface *one, *other;
    int64_t room, count, *pairs;
} Found;

static Box box_of(const Surface *s, int64_t t)
{
    const double *p = s->points + 3 * s->corners[3 * t];
    Box found = {{p[0], p[1], p[2]}, {p[0], p[1], p[2]}, 0, {0}, {0}};
    for (int c = 1; c < 3; c++) {
        p = s->points + 3 * s->corners[3 * t + c];
        for (int i = 0; i < 3; i++) {
            found.low[i] = LESS(p[i], found.low[i]);
            found.high[i] = MORE(p[i], found.high[i]);
        }
    }
    for (int i = 0; i < 3; i++)
        found.size = MORE(found.size, found.high[i] - found.low[i]);
    return found;
}

static void widen(Box *box, const Box *other)
{
    for (int i = 0; i < 3; i++) {
        box->low[i] = LESS(box->low[i], other->low[i]);
        box->high[i] = MORE(box->high[i], other->high[i]);
    }
}

/* Cell numbers increase with coordinates, so that two boxes that touch share the cell of the greater of their low corners. */
static void place(const Grid *grid, Box *box)
{
    double share = 1 / grid->edge;
    for (int i = 0; i < 3; i++) {
        double first = (box->low[i] - grid->low[i]) * share, last = (box->high[i] - grid->low[i]) * share;
        box->first[i] = first < 1 ? 0 : first < grid->size[i] ? (int)first : grid->size[i] - 1;
        box->last[i] = last < 1 ? 0 : last < grid->size[i] ? (int)last : grid->size[i] - 1;
    }
}

/* About two cells per box at most, each no smaller than the average box. */
static void measure(Grid *grid)
{
    double extent = 0, volume = 1;
    grid->hull = grid->boxes[0];
    for (int64_t t = 0; t < grid->count; t++) {
        widen(&grid->hull, grid->boxes + t);
        extent += grid->boxes[t].size / (double)grid->count;
    }
    for (int i = 0; i < 3; i++)
        volume *= grid->hull.high[i] - grid->hull.low[i] + extent;
    grid->edge = MORE(extent, cbrt(volume / (2 * (double)grid->count)));
    for (int i = 0; i < 3; i++) {
        grid->low[i] = grid->hull.low[i];
        grid->size[i] = grid->edge > 0 ? (int)LESS(1000, 1 + (grid->hull.high[i] - grid->low[i]) / grid->edge) : 1;
    }
}

static void cross(const double *a, const double *b, double *found)
{
    for (int i = 0; i < 3; i++)
        found[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* 1 if all of a is certainly above or below all of b along a normal, else 0; within: a bound on the error of heights. */
static int separates(const double *normal, double (*a)[3], double (*b)[3], double within)
{
    double lows[2] = {INFINITY, INFINITY}, highs[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 6; k++) {
        const double *p = k < 3 ? a[k] : b[k - 3];
        double height = normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2];
        lows[k / 3] = LESS(height, lows[k / 3]);
        highs[k / 3] = MORE(height, highs[k / 3]);
    }
    return lows[0] - highs[1] > within || lows[1] - highs[0] > within;
}

/* 1 or -1 if all points are certainly above or all below the plane through the origin with this normal, else 0. */
static int side(const double *normal, double (*points)[3], int count, double within)
{
    int above = 0, below = 0;
    for (int k = 0; k < count; k++) {
        const double *p = points[k];
        double height = normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2];
        above += height > within;
        below += height < -within;
    }
    return (above == count) - (below == count);
}

/* Two triangles with one corner in common, the origin: 1 if a plane through it certainly separates their other corners, else 0. */
static int parted_at_corner(double (*a)[3], double (*b)[3], double size)
{
    double normal[3], across[3], up[2], down[2], within = SURE * size * size;
    for (int i = 0; i < 3; i++)
        normal[i] = a[0][i] + a[1][i] - b[0][i] - b[1][i];
    for (int k = 0; k < 2; k++)
        for (int i = up[k] = down[k] = 0; i < 3; i++) {
            up[k] += normal[i] * a[k][i];
            down[k] -= normal[i] * b[k][i];
        }
    if ((LESS(up[0], up[1]) > within) & (LESS(down[0], down[1]) > within))
        return 1;
    for (int turn = 0; turn < 2; turn++) {
        double (*one)[3] = turn ? b : a, (*other)[3] = turn ? a : b;
        cross(one[0], one[1], across);
        if (side(across, other, 2, within * size))
            return 1; /* the other is on one side of this one's plane */
        for (int k = 0; k < 2; k++) { /* the plane through an edge, normal to this one's */
            cross(across, one[k], normal);
            if (side(normal, other, 2, within * size * size) * side(normal, one + 1 - k, 1, within * size * size) < 0)
                return 1;
        }
    }
    return 0;
}

static int parted(double (*a)[3], double (*b)[3], double size)
{
    double normal[3], edges[2][3];
    for (int i = 0; i < 3; i++)
        normal[i] = a[0][i] + a[1][i] + a[2][i] - b[0][i] - b[1][i] - b[2][i];
    if (separates(normal, a, b, SURE * size * size))
        return 1;
    for (int side = 0; side < 2; side++) {
        double (*one)[3] = side ? b : a, (*other)[3] = side ? a : b;
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < 3; i++)
                edges[k][i] = one[k + 1][i] - one[0][i];
        cross(edges[0], edges[1], normal);
        if (separates(normal, one, other, SURE * size * size * size))
            return 1;
    }
    return 0;
}

/* 1 if triangles s and t may meet elsewhere than at a common corner, else 0; point indices are compared if both are of one surface.
   The sizes of their boxes, which touch, add up to size. */
static int may_meet(const Surface *one, int64_t s, const Surface *other, int64_t t, double size)
{
    const int64_t *names = one->corners + 3 * s, *others = other->corners + 3 * t;
    int shared = 0, mine = 0, its = 0;
    for (int i = 0; i < 3 && one->points == other->points; i++)
        for (int j = 0; j < 3; j++) { /* no branches, which would be mispredicted */
            int same = names[i] == others[j];
            shared += same;
            mine += same * i;
            its += same * j;
        }
    if (shared > 1)
        return 0;
    if (!(size > 1e-50)) /* its powers would underflow */
        return 1;
    double a[3][3], b[3][3];
    const double *origin = one->points + 3 * names[mine];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            a[k][i] = one->points[3 * names[(mine + k) % 3] + i] - origin[i];
            b[k][i] = other->points[3 * others[(its + k) % 3] + i] - origin[i];
        }
    size *= 6; /* covers sums and differences of three corners */
    return !(shared ? parted_at_corner(a + 1, b + 1, size) : parted(a, b, size));
}

#define EVERY_CELL(box)                                                                       \
    for (int x = (box).first[0]; x <= (box).last[0]; x++)                                    \
        for (int y = (box).first[1]; y <= (box).last[1]; y++)                                \
            for (int64_t z = (box).first[2], at = ((int64_t)x * grid->size[1] + y) * grid->size[2] + z; z <= (box).last[2]; z++, at++)

/* Sort boxes into the cells of the grid; 0 if out of memory. */
static int fill(Grid *grid)
{
    int64_t cells = (int64_t)grid->size[0] * grid->size[1] * grid->size[2];
    grid->starts = calloc((size_t)cells + 2, sizeof *grid->starts);
    for (int64_t t = 0; grid->starts && t < grid->count; t++) {
        place(grid, grid->boxes + t);
        EVERY_CELL(grid->boxes[t])
            grid->starts[at + 2]++;
    }
    for (int64_t c = 2; grid->starts && c < cells + 2; c++)
        grid->starts[c] += grid->starts[c - 1];
    grid->inside = grid->starts ? malloc((size_t)(grid->starts[cells + 1] + 1) * sizeof *grid->inside) : NULL;
    for (int64_t t = 0; grid->inside && t < grid->count; t++)
        EVERY_CELL(grid->boxes[t])
            grid->inside[grid->starts[at + 1]++] = t;
    return grid->inside != NULL;
}

void forget(Grid *grid)
{
    free(grid->starts);
    free(grid->inside);
    free(grid->boxes);
    free(grid);
}

/* The triangles of a non-empty surface, sorted into a grid; NULL if out of memory. The caller must forget() it. */
Grid *sorted(Surface surface)
{
    Grid *grid = calloc(1, sizeof *grid);
    if (!grid)
        return NULL;
    grid->count = surface.count;
    grid->boxes = malloc((size_t)surface.count * sizeof *grid->boxes);
    for (int64_t t = 0; grid->boxes && t < surface.count; t++)
        grid->boxes[t] = box_of(&surface, t);
    if (grid->boxes)
        measure(grid);
    if (grid->boxes && fill(grid))
        return grid;
    forget(grid);
    return NULL;
}

/* 1 if boxes overlap and the cell is that of the greater of their low corners, which finds each pair once; no branches. */
static int meet_in(const int *cell, const Box *one, const Box *other)
{
    int found = 1;
    for (int i = 0; i < 3; i++) {
        found &= (one->low[i] <= other->high[i]) & (other->low[i] <= one->high[i]);
        found &= cell[i] == MORE(one->first[i], other->first[i]);
    }
    return found;
}

static void add(Found *found, int64_t s, const Box *box, int64_t t, const Box *its)
{
    if (!may_meet(found->one, s, found->other, t, box->size + its->size))
        return;
    if (found->count < found->room) {
        found->pairs[2 * found->count] = s;
        found->pairs[2 * found->count + 1] = t;
    }
    found->count++;
}

/* Add the pairs of triangle s with those of the cell in inside, from first to last. */
static void add_in(Found *found, const Grid *grid, const int *cell, int64_t s, const Box *box, int64_t first, int64_t last)
{
    int64_t near[32];
    while (first < last) {
        int count = 0;
        for (int64_t end = LESS(last, first + 32); first < end; first++) {
            near[count] = grid->inside[first];
            count += meet_in(cell, box, grid->boxes + near[count]);
        }
        for (int k = 0; k < count; k++)
            add(found, s, box, near[k], grid->boxes + near[k]);
    }
}

static void add_of_one(Found *found, const Grid *grid)
{
    Box whole = {{0}, {0}, 0, {0}, {grid->size[0] - 1, grid->size[1] - 1, grid->size[2] - 1}};
    EVERY_CELL(whole)
        for (int64_t i = grid->starts[at]; i < grid->starts[at + 1]; i++) {
            int64_t s = grid->inside[i];
            add_in(found, grid, (int[]){x, y, (int)z}, s, grid->boxes + s, i + 1, grid->starts[at + 1]);
        }
}

/* 1 if a triangle is on one side of a box along an axis, else 0. */
static int beyond(const Surface *s, int64_t t, const Box *box)
{
    const double *p[3];
    for (int c = 0; c < 3; c++)
        p[c] = s->points + 3 * s->corners[3 * t + c];
    for (int i = 0; i < 3; i++)
        if ((p[0][i] < box->low[i] && p[1][i] < box->low[i] && p[2][i] < box->low[i])
            || (p[0][i] > box->high[i] && p[1][i] > box->high[i] && p[2][i] > box->high[i]))
            return 1;
    return 0;
}

static void add_of_two(Found *found, const Grid *grid)
{
    for (int64_t s = 0; s < found->one->count; s++) {
        if (beyond(found->one, s, &grid->hull))
            continue;
        Box box = box_of(found->one, s);
        place(grid, &box);
        EVERY_CELL(box)
            add_in(found, grid, (int[]){x, y, (int)z}, s, &box, grid->starts[at], grid->starts[at + 1]);
    }
}

/* Fill up to room pairs (room, 2) of triangles of two surfaces, or of one with itself, each pair once; grid is the other, sorted.
   The result is the number of pairs, which may exceed room. */
int64_t near_pairs(Surface one, Surface other, const Grid *grid, int itself, int64_t room, int64_t *pairs)
{
    Found found = {&one, &other, room, 0, pairs};
    if (itself)
        add_of_one(&found, grid);
    else
        add_of_two(&found, grid);
    return found.count;
}

static int meets_any(const Grid *grid, const Box *box)
{
    EVERY_CELL(*box)
        for (int64_t k = grid->starts[at]; k < grid->starts[at + 1]; k++) {
            const Box *other = grid->boxes + grid->inside[k];
            int found = 1;
            for (int i = 0; i < 3; i++)
                found &= (box->low[i] <= other->high[i]) & (other->low[i] <= box->high[i]);
            if (found)
                return 1;
        }
    return 0;
}

/* Fill found with the triangles of a surface whose boxes overlap one in the grid; the result is their number. */
int64_t reached(Surface surface, const Grid *grid, int64_t *found)
{
    int64_t count = 0;
    for (int64_t t = 0; t < surface.count; t++) {
        if (beyond(&surface, t, &grid->hull))
            continue;
        Box box = box_of(&surface, t);
        place(grid, &box);
        if (meets_any(grid, &box))
            found[count++] = t;
    }
    return count;
}

static int64_t first(int64_t *before, int64_t vertex)
{
    while (before[vertex] != vertex)
        vertex = before[vertex] = before[before[vertex]];
    return vertex;
}

/* Fill before with the first vertex of the part of each of count vertices; triangles connect their corners. */
void parts(Surface surface, int64_t count, int64_t *before)
{
    for (int64_t v = 0; v < count; v++)
        before[v] = v;
    for (int64_t t = 0; t < surface.count; t++)
        for (int c = 1; c < 3; c++) {
            int64_t one = first(before, surface.corners[3 * t]), other = first(before, surface.corners[3 * t + c]);
            before[MORE(one, other)] = LESS(one, other);
        }
    for (int64_t v = 0; v < count; v++)
        before[v] = before[before[v]];
}
