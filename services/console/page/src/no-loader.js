// Stubs for three's mesh loaders, which urdf-loader imports and Leo's body does not need.

export class STLLoader {}
export class ColladaLoader {}
