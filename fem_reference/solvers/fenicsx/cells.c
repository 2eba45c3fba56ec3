/* Residual and tangent of an energy per rest volume: sums over the quadrature points of each finite element.

   The caller gives the first and second derivatives of the energy at the points; this code combines them with the basis of the
   element. Order of the variables at a point: for each component i of the displacement, its derivatives along x, y and z and, if
   KINDS is 4, the component itself; then the pressure, if PRESSURES is not 0. Order of the given derivatives: the first derivatives
   (one for each of the VARIABLES), then the upper triangle of the second derivatives, row by row.

   Order of the unknowns of a cell: for each component of the displacement the values at the NODES, then the PRESSURES.

   The sizes are compile-time constants: POINTS (of the quadrature), NODES, PRESSURES, GEOMETRY (the nodes that define the shape of
   the cell) and KINDS.
*/

#define VARIABLES (3 * KINDS + (PRESSURES > 0))
#define SECOND (VARIABLES * (VARIABLES + 1) / 2)
#define UNKNOWNS (3 * NODES + PRESSURES)
#define WIDE ((NODES + 3) / 4) /* vectors of four that hold one value for each node */
#define ROWS (POINTS * KINDS)

typedef double vector __attribute__((vector_size(32), aligned(32)));
typedef struct { /* the element at its quadrature points */
    const double *weights;   /* (POINTS) */
    const double *shape;     /* (POINTS, GEOMETRY, 3) gradients of the basis of the geometry */
    const double *slopes;    /* (POINTS, NODES, 3) gradients of the basis of a displacement component */
    const double *values;    /* (POINTS, NODES) values of the same basis */
    const double *pressures; /* (POINTS, PRESSURES or 1) values of the basis of the pressure */
} Element;

/* The index of the second derivative with respect to variables v and w, v <= w. */
static inline int second(int v, int w) { return VARIABLES + v * VARIABLES - v * (v - 1) / 2 + w - v; }

/* For a cell at x: the ROWS that map the nodal values of a component to its variables, and the weights (POINTS) times rest volume.
*/
static void basis(const Element *e, const double *x, vector (*rows)[WIDE], double *weights)
{
    for (int q = 0; q < POINTS; q++) {
        double to[3][3] = {{0}}, inverse[3][3];
        for (int g = 0; g < GEOMETRY; g++)
            for (int i = 0; i < 3; i++)
                for (int r = 0; r < 3; r++)
                    to[i][r] += x[3 * g + i] * e->shape[(q * GEOMETRY + g) * 3 + r];
        for (int i = 0; i < 3; i++)
            for (int r = 0; r < 3; r++) {
                int j = (i + 1) % 3, k = (i + 2) % 3, s = (r + 1) % 3, t = (r + 2) % 3;
                inverse[r][i] = to[j][s] * to[k][t] - to[j][t] * to[k][s];
            }
        double volume = to[0][0] * inverse[0][0] + to[0][1] * inverse[1][0] + to[0][2] * inverse[2][0];
        weights[q] = e->weights[q] * (volume < 0 ? -volume : volume);
        for (int k = 0; k < KINDS; k++) {
            double *row = (double *)rows[q * KINDS + k];
            for (int b = 0; b < 4 * WIDE; b++) {
                const double *slope = e->slopes + (q * NODES + b) * 3;
                if (b >= NODES)
                    row[b] = 0;
                else if (k == 3)
                    row[b] = e->values[q * NODES + b];
                else
                    row[b] = (slope[0] * inverse[0][k] + slope[1] * inverse[1][k] + slope[2] * inverse[2][k]) / volume;
            }
        }
    }
}

static void cell_residual(const Element *e, const double *given, int stride, vector (*rows)[WIDE], const double *weights,
                          double *residual)
{
    for (int i = 0; i < 3; i++) {
        vector sum[WIDE] = {{0}};
        for (int q = 0; q < POINTS; q++)
            for (int k = 0; k < KINDS; k++)
                for (int n = 0; n < WIDE; n++)
                    sum[n] += weights[q] * given[q * stride + i * KINDS + k] * rows[q * KINDS + k][n];
        for (int a = 0; a < NODES; a++)
            residual[i * NODES + a] = ((double *)sum)[a];
    }
    for (int c = 0; c < PRESSURES; c++) {
        double sum = 0;
        for (int q = 0; q < POINTS; q++)
            sum += weights[q] * given[q * stride + VARIABLES - 1] * e->pressures[q * PRESSURES + c];
        residual[3 * NODES + c] = sum;
    }
}

/* The block of the tangent that couples the displacement components i <= j. */
static void between(int i, int j, const double *given, int stride, vector (*rows)[WIDE], const double *weights,
                    double (*tangent)[UNKNOWNS])
{
    static _Thread_local vector stressed[ROWS][WIDE];
    for (int q = 0; q < POINTS; q++)
        for (int l = 0; l < KINDS; l++) {
            vector sum[WIDE] = {{0}};
            for (int k = 0; k < KINDS; k++) {
                int v = i * KINDS + k, w = j * KINDS + l;
                double value = weights[q] * given[q * stride + (v < w ? second(v, w) : second(w, v))];
                for (int n = 0; n < WIDE; n++)
                    sum[n] += value * rows[q * KINDS + k][n];
            }
            for (int n = 0; n < WIDE; n++)
                stressed[q * KINDS + l][n] = sum[n];
        }
    for (int a = 0; a < NODES; a++) {
        vector sum[WIDE] = {{0}};
        for (int m = 0; m < ROWS; m++) {
            double value = ((double *)stressed[m])[a];
            for (int n = 0; n < WIDE; n++)
                sum[n] += value * rows[m][n];
        }
        for (int b = 0; b < NODES; b++) {
            tangent[i * NODES + a][j * NODES + b] = ((double *)sum)[b];
            tangent[j * NODES + b][i * NODES + a] = ((double *)sum)[b];
        }
    }
}

/* The blocks of the tangent that involve the pressure, whose unknowns are scaled by ``unit``. */
static void with_pressure(const Element *e, const double *given, int stride, vector (*rows)[WIDE], const double *weights,
                          double unit, double (*tangent)[UNKNOWNS])
{
    for (int c = 0; c < PRESSURES; c++) {
        for (int i = 0; i < 3; i++) {
            vector sum[WIDE] = {{0}};
            for (int q = 0; q < POINTS; q++)
                for (int k = 0; k < KINDS; k++) {
                    double value = unit * weights[q] * e->pressures[q * PRESSURES + c] *
                                   given[q * stride + second(i * KINDS + k, VARIABLES - 1)];
                    for (int n = 0; n < WIDE; n++)
                        sum[n] += value * rows[q * KINDS + k][n];
                }
            for (int a = 0; a < NODES; a++)
                tangent[i * NODES + a][3 * NODES + c] = tangent[3 * NODES + c][i * NODES + a] = ((double *)sum)[a];
        }
        for (int d = 0; d < PRESSURES; d++) {
            double sum = 0;
            for (int q = 0; q < POINTS; q++)
                sum += weights[q] * given[q * stride + second(VARIABLES - 1, VARIABLES - 1)] *
                       e->pressures[q * PRESSURES + c] * e->pressures[q * PRESSURES + d];
            tangent[3 * NODES + c][3 * NODES + d] = unit * unit * sum;
        }
    }
}

/* Adds the contributions of ``count`` cells at x (count, GEOMETRY, 3), computed from the derivatives ``given`` (count, POINTS,
   stride).

   The forces are added to ``residual`` at the ``unknowns`` (count, UNKNOWNS) of the cells. Unless ``tangent`` is null, the tangent
   of the cells is added to it at the indices ``places`` (count, UNKNOWNS, UNKNOWNS), with the pressures scaled by ``unit``. Unless
   ``moves`` is null, the tangent times these changes of the displacement is also added to ``residual``. */
void add_cells(const Element *e, long count, const double *x, const double *given, int stride, const int *unknowns,
               const int *places, double *residual, double *tangent, double unit, const double *moves)
{
    static _Thread_local vector rows[ROWS][WIDE];
    static _Thread_local double own[UNKNOWNS][UNKNOWNS];
    double weights[POINTS], forces[UNKNOWNS];
    for (long cell = 0; cell < count; cell++) {
        const double *here = given + cell * POINTS * stride;
        const int *name = unknowns + cell * UNKNOWNS;
        basis(e, x + cell * GEOMETRY * 3, rows, weights);
        cell_residual(e, here, stride, rows, weights, forces);
        if (tangent) {
            const int *place = places + cell * UNKNOWNS * UNKNOWNS;
            for (int i = 0; i < 3; i++)
                for (int j = i; j < 3; j++)
                    between(i, j, here, stride, rows, weights, own);
            with_pressure(e, here, stride, rows, weights, unit, own);
            for (int r = 0; r < UNKNOWNS; r++)
                for (int c = 0; c < UNKNOWNS; c++) {
                    tangent[place[r * UNKNOWNS + c]] += own[r][c];
                    if (moves)
                        forces[r] += own[r][c] * moves[name[c]] / (r < 3 * NODES ? 1 : unit);
                }
        }
        for (int r = 0; r < UNKNOWNS; r++)
            residual[name[r]] += forces[r];
    }
}

/* Adds to the tangent the contributions of ``count`` points in ``cells`` (count). ``slope`` (count, 3, 3): the derivatives of the
   tractions with respect to the positions of the points; ``basis`` (count, NODES): the values of the basis functions there. */
void add_points(long count, const int *cells, const double *basis, const double *slope, const int *places, double *tangent)
{
    for (long point = 0; point < count; point++) {
        const int *place = places + (long)cells[point] * UNKNOWNS * UNKNOWNS;
        const double *carried = basis + point * NODES;
        for (int i = 0; i < 3; i++)
            for (int a = 0; a < NODES; a++)
                for (int j = 0; j < 3; j++) {
                    double value = slope[9 * point + 3 * i + j] * carried[a];
                    for (int b = 0; b < NODES; b++)
                        tangent[place[(i * NODES + a) * UNKNOWNS + j * NODES + b]] += value * carried[b];
                }
    }
}

/* Finds the indices ``places`` of the cells' entries in a sparse matrix whose rows begin at ``starts`` in the sorted ``columns``.
An
   entry in a ``fixed`` row or column gets the index ``nowhere``. */
void find_places(long count, const int *unknowns, const int *starts, const int *columns, const char *fixed, int nowhere,
                 int *places)
{
    for (long cell = 0; cell < count; cell++)
        for (int r = 0; r < UNKNOWNS; r++) {
            const int *name = unknowns + cell * UNKNOWNS;
            int row = name[r];
            for (int c = 0; c < UNKNOWNS; c++) {
                int low = starts[row], high = starts[row + 1] - 1, column = name[c];
                while (low < high) {
                    int middle = (low + high) / 2;
                    if (columns[middle] < column)
                        low = middle + 1;
                    else
                        high = middle;
                }
                places[(cell * UNKNOWNS + r) * UNKNOWNS + c] = fixed[row] || fixed[column] ? nowhere : low;
            }
        }
}
